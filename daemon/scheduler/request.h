// SPDX-License-Identifier: MIT
// What a distribution rule knows of a request: plain values, no socket, no database. Times come from whoever drives the
// scheduler (the daemon's steady clock, the simulator's virtual one); the scheduler has no clock of its own.
#pragma once

#include <chrono>
#include <compare>
#include <cstdint>
#include <memory>

namespace pmcd::scheduler {

/// Time since an arbitrary start that stays the same for the life of a scheduler.
using Time = std::chrono::nanoseconds;

using RequestKey = std::uint64_t;  ///< given by whoever enqueues; unique and never reused within one scheduler
using SessionKey = std::uint64_t;
using MeshKey = std::uint64_t;

class MeshProfile;

/// One request for one packet, waiting or running.
struct Request {
  RequestKey key = 0;
  SessionKey session = 0;
  MeshKey mesh = 0;
  std::uint32_t packet = 0;
  std::uint64_t size_bytes = 0;    ///< stored size of the whole packet, also when only a part is still to be sent
  std::uint64_t offset_bytes = 0;  ///< already sent; remaining_bytes() remain
  std::uint64_t rest_bytes = 0;    ///< of the packets of this mesh behind the requested one
  std::shared_ptr<const MeshProfile> profile;  ///< what the mesh's packets bring; null: not known, or no mesh
  Time asked_at{0};                            ///< when the client asked; never changes
  Time queued_at{0};                           ///< when it joined the queue; set anew when it goes back
  /// Set by rule fcsf when it starts, and kept here so that it ends with the request, however that leaves.
  bool is_second_of_burst = false;

  [[nodiscard]] std::uint64_t remaining_bytes() const { return size_bytes - offset_bytes; }
};

/// The order of requests that a rule holds equal: queued_at, then session, then key. Total, so every choice repeats.
struct QueueOrder {
  Time queued_at{0};
  SessionKey session = 0;
  RequestKey key = 0;

  static QueueOrder of(const Request& request) { return {request.queued_at, request.session, request.key}; }
  auto operator<=>(const QueueOrder&) const = default;  // NOLINT(modernize-use-nullptr): clang-tidy 14 errs
};

}  // namespace pmcd::scheduler
