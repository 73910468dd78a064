// SPDX-License-Identifier: MIT
// A line that all jobs share equally, on paper: what a server that cuts its capacity into equal shares, none larger
// than its job can take, would have done by now, and which job it would finish next. No real byte moves here.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "daemon/scheduler/key_map.h"
#include "daemon/scheduler/sorted_blocks.h"

namespace pmcd::scheduler {

class VirtualServer {
 public:
  using JobId = std::uint64_t;

  /// A place in the order in which jobs finish. Those that have finished come first.
  struct Finish {
    bool to_come = false;  ///< it has not finished yet
    double when = 0;       ///< seconds at which it will if nothing changes; of a finished one a running number
    JobId job = 0;
    auto operator<=>(const Finish&) const = default;  // NOLINT(modernize-use-nullptr): clang-tidy 14 errs
  };

  /// The line's capacity in bytes a second from now on. REQUIRES: more than 0.
  void set_capacity(double capacity);
  /// A job of `bytes` that takes at most `cap` bytes a second (infinite: whatever there is). REQUIRES: bytes and cap
  /// more than 0, the id is new. [O(log n), and O(log n) for each job that is no longer, or newly, held by its cap]
  void add(JobId job, double bytes, double cap);
  void set_cap(JobId job, double cap);
  void remove(JobId job);
  /// Whether the job counts among those of which next_marked() is one.
  void mark(JobId job, bool marked);
  /// Serves until `now` seconds. REQUIRES: it does not go back.
  void advance(double now);

  [[nodiscard]] bool contains(JobId job) const { return jobs_.contains(job); }
  [[nodiscard]] bool finished(JobId job) const { return jobs_.find(job)->state == State::finished; }
  [[nodiscard]] Finish finish(JobId job) const;
  /// The marked job that finishes first. [O(1)]
  [[nodiscard]] std::optional<JobId> next_marked() const;
  /// Bytes a second that a job gets at present, 0 once it has finished.
  [[nodiscard]] double rate(JobId job) const;
  [[nodiscard]] double now() const { return now_; }

 private:
  enum class State : std::uint8_t {
    capped,    ///< gets its cap; its tag is the time of its finish
    sharing,   ///< gets an equal share; its tag is what `served_` will be at its finish
    finished,  ///< its tag is its number
  };
  struct Job {
    State state = State::sharing;
    double tag = 0;
    double cap = 0;
    bool marked = false;
  };
  using Order = SortedBlocks<std::pair<double, JobId>>;

  void place(JobId id, Job& job, State state, double tag);
  void unplace(JobId id, const Job& job);
  [[nodiscard]] double left(const Job& job) const;
  /// Moves jobs between capped and sharing until each is where it belongs, and sets the share.
  void level();
  void finish_first(State state);
  [[nodiscard]] double share_of_all() const;
  [[nodiscard]] double sharing_finish(double tag) const;

  double capacity_ = 1;
  double now_ = 0;
  double share_ = 0;   ///< bytes a second of each sharing job
  double served_ = 0;  ///< bytes that a job would have got that shares since the beginning
  double capped_rate_ = 0;
  std::uint64_t finished_count_ = 0;
  KeyMap<Job> jobs_;
  Order tags_[3];         ///< by state
  Order marked_tags_[3];  ///< the same of those that are marked
  Order caps_[2];         ///< capped and sharing jobs by their caps
};

}  // namespace pmcd::scheduler
