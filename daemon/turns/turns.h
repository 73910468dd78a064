// SPDX-License-Identifier: MIT
// Turns: when the scheduler gives a request a slot, its content leaves here, chunk by chunk, until its turn is over or
// its client's kernel has acknowledged its last byte. What is seen of each client's stream goes to the scheduler. No
// socket and no clock: a Host has them, in the daemon and in the simulator. It knows no rule and moves no bytes. One
// thread at a time. Turns are in turns.cpp, what is seen of the streams in watch.cpp.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <unordered_map>
#include <utility>
#include <vector>

#include "daemon/scheduler/scheduler.h"
#include "daemon/turns/host.h"
#include "daemon/turns/limits.h"
#include "daemon/turns/line.h"

namespace pmcd::turns {

class Turns {
 public:
  using Key = scheduler::RequestKey;
  using SessionKey = scheduler::SessionKey;

  /// REQUIRES: of the policy, as the scheduler; host and limits outlive it.
  Turns(scheduler::Policy policy, Host& host, const Limits& limits);

  /// Waits for a slot; nothing of it happens before this has returned.
  void enqueue(scheduler::Request request);
  /// Ends a request whose end is not queued yet: Host::end() is called before this returns, and what was sent keeps the
  /// slot until it is acknowledged. No effect on others.
  void cancel(Key key);
  /// What a request sends is at hand, or will never be. No effect on one that does not wait for that.
  void ready(Key key, const Content& content);
  void fail(Key key);

  /// The session's stream has written something: its requests may go on.
  void progress(SessionKey session);
  /// The session's client asks for more, so it has mostly acknowledged what it had: its slots may be free.
  void heard(SessionKey session);
  /// The session is closed: its requests leave the queue and its slots are free. Their keys.
  std::vector<Key> session_gone(SessionKey session);

  /// From now on this policy decides: waiting requests are put in its order, running ones go on until it interrupts
  /// them. REQUIRES: as the scheduler's.
  void switch_to(scheduler::Policy policy);
  /// As the scheduler's.
  void set_weight(SessionKey session, double weight);
  /// No waiting request gets a slot any more; running ones go on to their end.
  void drain() { draining_ = true; }

  /// Gives free slots to waiting requests.
  void pump();
  /// Looks at all streams that are due, frees slots and drops clients that take nothing. When to do it again.
  /// To be called while has_to_poll(). [O(log n), and a system call or two, for each stream that is due; four times a
  /// second O(n) of those that have something under way]
  Time poll();
  /// Whether anything runs or is owed.
  [[nodiscard]] bool has_to_poll() const { return !looks_.empty(); }

  [[nodiscard]] const scheduler::Scheduler& scheduler() const { return scheduler_; }
  /// Turns that a quantum has ended.
  [[nodiscard]] std::uint64_t interruptions() const { return interruptions_; }

  struct Progress {
    Key key = 0;
    bool is_stopped = false;       ///< interrupted; will wait once its client has taken what was queued for it
    std::uint64_t sent_bytes = 0;  ///< of its content, what was sent in earlier turns and what it began behind included
  };
  /// What holds a slot or is stopped.
  [[nodiscard]] std::vector<Progress> running() const;

 private:
  enum class Stage : std::uint8_t {
    fetching,
    sending,  ///< chunks are queued as the stream has room
    stopped,  ///< interrupted without a slot; waits again once the stream has taken what was queued
    sent,     ///< its end is queued; the slot is held until that is acknowledged
  };
  struct Running {
    SessionKey session = 0;
    Stage stage = Stage::fetching;
    bool cancelled = false;
    bool begun = false;  ///< a chunk of this turn is queued
    Content content;
    std::uint64_t next = 0;          ///< offset in the content of the next byte to send
    std::uint64_t end_position = 0;  ///< of the stream, once sent
  };
  /// A session that has had a turn.
  struct Served {
    Line line;
    std::vector<Key> running;
  };

  void begin(const scheduler::Request& request);
  Served& served(SessionKey session, Key key);
  /// Runs a step of a request; an exception ends its session and nothing else.
  template <typename Step>
  void guarded(Key key, Step step);
  void feed(Key key);
  /// Where several share the uplink: whether enough is under way to a client of whom little is known.
  bool is_held_back(SessionKey session, Line& line);
  /// At a chunk boundary: whether the request may go on. If not, it waits again, or will once its stream is empty.
  bool may_go_on(Key key);
  /// A stopped request joins the queue.
  void wait_again(Key key);
  /// The end of the request is queued behind its last chunk.
  void end_sending(Key key);
  /// The request is over and its slot free.
  void release(Key key);

  /// Asks what the session's client has acknowledged, and tells the scheduler.
  void look(SessionKey session, Line& line, Time now);
  /// Those of the session's requests that are through, or may wait again, as of this look.
  void settle(SessionKey session);
  [[nodiscard]] bool is_through(Key key, const Running& running, Line& line);
  /// The session is looked at no later than then.
  void look_by(SessionKey session, Line& line, Time when);
  void set_look(SessionKey session, Line& line, Time when);
  [[nodiscard]] bool is_watched(SessionKey session, const Line& line) const {
    return looks_.contains({line.look_at, session});
  }
  /// Somebody waits and all slots are taken: asks sooner what was acknowledged.
  void hurry();
  void judge(Time now);

  static constexpr Time kFirstPause = std::chrono::milliseconds(1);
  static constexpr Time kLongestPause = std::chrono::milliseconds(20);

  scheduler::Scheduler scheduler_;
  Host& host_;
  const Limits& limits_;
  // In the order of their keys, so that a simulation repeats wherever it runs.
  std::map<Key, Running> running_;
  std::unordered_map<SessionKey, Served> served_;
  /// Sessions with something running or not acknowledged: they are watched. By the time of the next look.
  std::set<std::pair<Time, SessionKey>> looks_;
  std::set<Key> unhurried_;  ///< whose end is queued, and that were not looked at sooner because others wait
  std::uint64_t interruptions_ = 0;
  bool draining_ = false;
  Time polls_at_{0};   ///< when poll() is called next, as far as is known
  Time uplink_at_{0};  ///< when to look next whether the uplink has room
  Time judge_at_{0};
  bool judges_ = false;  ///< judge_at_ is set
};

}  // namespace pmcd::turns
