// SPDX-License-Identifier: MIT
// Who carries out what turns decide: the daemon's dispatcher over sockets, or the simulator over modelled connections.
#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <optional>

#include "daemon/scheduler/request.h"
#include "daemon/turns/pace.h"
#include "daemon/turns/stream.h"

namespace pmcd::turns {

/// What a request sends: of a packet, all of it.
struct Content {
  std::uint64_t bytes = 0;
  bool may_be_interrupted = true;
};

/// Functions that may end a client's session say so: it is told by Turns::session_gone() before they return.
class Host {
 public:
  using Key = scheduler::RequestKey;
  using SessionKey = scheduler::SessionKey;

  Host() = default;
  Host(const Host&) = delete;
  Host& operator=(const Host&) = delete;
  virtual ~Host() = default;

  /// Never falls.
  [[nodiscard]] virtual Time now() const = 0;
  /// Slots that are taken by what is no turn.
  virtual std::size_t other_slots() { return 0; }
  /// Turns::pump() is to be called, once, after what is being done now.
  virtual void pump_soon() = 0;
  /// Turns::poll() is to be called no later than then, if it is being called at all.
  virtual void poll_by(Time when) = 0;

  /// Of the client of a request that has its first turn.
  virtual std::shared_ptr<Stream> stream_of(Key key) = 0;
  /// A request has a slot. What it sends, if that is at hand; else Turns::ready() or fail() follows.
  virtual std::optional<Content> fetch(Key key) = 0;
  /// Queues a chunk of it.
  virtual void send(Key key, std::uint64_t offset, std::size_t size) = 0;
  /// Takes back what of it was queued last and has not begun to leave. Returns how many bytes of content.
  virtual std::size_t take_back(Key key) = 0;
  /// Queues its end behind its last chunk, or instead of what is left of a cancelled one. May end the session.
  virtual void end(Key key, bool is_cancelled) = 0;
  /// It is interrupted, and will have another turn.
  virtual void interrupted(Key key) = 0;
  /// It is over and its slot free. Not called for those that session_gone() has answered, but perhaps after it for
  /// one whose end has ended the session.
  virtual void released(Key key) = 0;
  /// It cannot go on: mostly for want of memory. Is to end its session.
  virtual void broken(Key key, const std::exception& error) = 0;
  /// A client does not take its data. Is to end its session.
  virtual void drop(SessionKey session, Pace::Verdict verdict) = 0;
};

}  // namespace pmcd::turns
