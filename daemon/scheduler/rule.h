// SPDX-License-Identifier: MIT
// The interface of a distribution rule: it is told what happens and answers who is next. A rule keeps its own order of
// the waiting requests and changes the key of a request only at an event of that request's own client, so that a choice
// costs O(log n). It touches no socket, no database and no clock, and never learns how many slots there are.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "daemon/scheduler/request.h"

namespace pmcd::scheduler {

/// How a running transfer ended.
enum class Outcome : std::uint8_t {
  complete,  ///< the whole packet is with the client
  failed,    ///< it will not be tried again
  requeued,  ///< interrupted; the rest waits again (enqueued() follows with the new queued_at)
};

class Rule {
 public:
  Rule() = default;
  Rule(const Rule&) = delete;
  Rule& operator=(const Rule&) = delete;
  virtual ~Rule() = default;

  /// The name in the registry, for instance "fifo".
  [[nodiscard]] virtual std::string_view name() const = 0;

  /// `request` waits from now on.
  virtual void enqueued(const Request& request) = 0;
  /// `request`, the same values as when it was enqueued, waits no longer: it was taken, or its session is gone.
  virtual void removed(const Request& request) = 0;
  /// The waiting request that goes next; none if nothing waits. The same answer until the next event.
  [[nodiscard]] virtual std::optional<RequestKey> next() const = 0;

  /// `request` got a slot (removed() came before).
  virtual void started(const Request& /*request*/, Time /*now*/) {}
  /// The client acknowledged `bytes` more of the running `request`.
  virtual void progressed(const Request& /*request*/, std::uint64_t /*bytes*/, Time /*now*/) {}
  /// The running `request` gave its slot back.
  virtual void finished(const Request& /*request*/, Outcome /*outcome*/, Time /*now*/) {}
  /// Nothing will come from `session` any more; its requests were removed or finished before.
  virtual void session_gone(SessionKey /*session*/, Time /*now*/) {}
};

}  // namespace pmcd::scheduler
