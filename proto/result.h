// SPDX-License-Identifier: MIT
// Errors of the protocol as values: what is wrong with the bytes, at which byte, and in words. proto throws nothing;
// every function that reads a peer's bytes returns a Result. The codes themselves stand in codes.h.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <variant>

#include "proto/codes.h"

namespace pmcd::proto {

struct Error {
  ErrorCode code = ErrorCode::internal_error;
  std::uint64_t where = 0;  ///< byte within the frame's body (or the list) at which reading stopped
  std::string detail;       ///< one sentence in plain words
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

}  // namespace pmcd::proto
