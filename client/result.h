// SPDX-License-Identifier: MIT
// What can go wrong between a client and a server, as values. Nothing in the client's public face throws, apart from
// running out of memory.
#pragma once

#include <cstdint>
#include <string>

#include "codec/result.h"
#include "proto/codes.h"

namespace pmcd::client {

enum class Failure : std::uint8_t {
  bad_address,     ///< the address given is none
  cannot_reach,    ///< no connection came about
  refused,         ///< the server answered with an error: see code and text
  violation,       ///< the server broke the protocol
  damaged,         ///< a packet is not what its directory announced
  limit_exceeded,  ///< the server sent more than the options allow
  timed_out,       ///< nothing came for as long as the options allow
  lost,            ///< a connection broke
  no_such_handle,  ///< the handle was not given out by this Session
  no_such_level,   ///< the mesh does not have the level that was asked for
  bad_state,       ///< the state to go on from contradicts itself
  cancelled,       ///< the caller asked to stop
};

/// The stable name, for instance "cannot_reach". Never null.
const char* failure_name(Failure failure);

struct Error {
  Failure failure = Failure::violation;
  proto::ErrorCode code = proto::ErrorCode::none;  ///< of the server, if it refused
  std::string text;                                ///< one sentence that says what happened and, if known, what to do
};

template <typename T>
using Result = codec::Result<T, Error>;

}  // namespace pmcd::client
