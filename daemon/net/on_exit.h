// SPDX-License-Identifier: MIT
// Does something when a function or a coroutine is left, also by an exception: gives back a place that was taken.
#pragma once

#include <utility>

namespace pmcd::net {

template <typename Action>
class OnExit {
 public:
  explicit OnExit(Action action) : action_(std::move(action)) {}
  OnExit(const OnExit&) = delete;
  OnExit& operator=(const OnExit&) = delete;
  ~OnExit() { action_(); }

 private:
  Action action_;
};

}  // namespace pmcd::net
