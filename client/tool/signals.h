// SPDX-License-Identifier: GPL-3.0-or-later
// Ctrl-C and its relatives as a stop token: the first one asks the work to end in order, the second one ends the
// program.
#pragma once

#include <atomic>
#include <csignal>
#include <stop_token>
#include <string>
#include <thread>

namespace pmcd::tool {

/// While it lives, SIGINT, SIGTERM and SIGHUP (those that are not ignored) request a stop. Make it before other
/// threads: they inherit its signal mask.
class StopOnSignal {
 public:
  StopOnSignal();
  ~StopOnSignal();
  StopOnSignal(const StopOnSignal&) = delete;
  StopOnSignal& operator=(const StopOnSignal&) = delete;

  [[nodiscard]] std::stop_token token() const { return source_.get_token(); }
  /// The signal that came, 0 if none. The exit code for it is 128 + the signal, as shells have it.
  [[nodiscard]] int signal() const { return signal_; }

 private:
  void watch();

  sigset_t before_{};
  sigset_t watched_{};
  std::stop_source source_;
  std::atomic<int> signal_{0};
  int wake_;  ///< an eventfd: ends the thread
  std::thread thread_;
};

/// "SIGINT" and so on.
std::string signal_name(int signal);

}  // namespace pmcd::tool
