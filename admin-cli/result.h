// SPDX-License-Identifier: GPL-3.0-or-later
// How pmcctl ends, and errors on the way there.
#pragma once

#include <string>

#include "proto/codes.h"

namespace pmcd::admin {

// The exit codes of pmctool and pmcctl: 1 is for questions whose answer is no, which pmcctl has none of.
inline constexpr int kDone = 0;
inline constexpr int kUsage = 2;
inline constexpr int kBadInput = 3;
inline constexpr int kRefused = 4;  ///< cannot reach the daemon, or it refused

struct Failure {
  int exit_code = kRefused;
  proto::ErrorCode code = proto::ErrorCode::none;  ///< of the daemon, if it answered with one
  std::string text;
};

}  // namespace pmcd::admin
