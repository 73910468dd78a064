// SPDX-License-Identifier: MIT
// What can go wrong between a client and a server, as values. Nothing in the client's public face throws, apart from
// running out of memory.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <variant>

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
};

/// The stable name, for instance "cannot_reach". Never null.
const char* failure_name(Failure failure);

struct Error {
  Failure failure = Failure::violation;
  proto::ErrorCode code = proto::ErrorCode::none;  ///< of the server, if it refused
  std::string text;                                ///< one sentence that says what happened and, if known, what to do
};

/// A value or an Error. REQUIRES: value() only if ok(), error() only if not.
template <typename T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}      // NOLINT(google-explicit-constructor)
  Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}  // NOLINT(google-explicit-constructor)

  [[nodiscard]] bool ok() const { return state_.index() == 0; }
  explicit operator bool() const { return ok(); }

  T& value() & { return *std::get_if<0>(&state_); }
  const T& value() const& { return *std::get_if<0>(&state_); }
  T value() && { return std::move(*std::get_if<0>(&state_)); }
  const Error& error() const { return *std::get_if<1>(&state_); }

  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }

 private:
  std::variant<T, Error> state_;
};

}  // namespace pmcd::client
