// SPDX-License-Identifier: GPL-3.0-or-later
// One line on the terminal that says what is done and how far it is. Nothing at all where stderr is no terminal.
#pragma once

#include <chrono>
#include <string>

namespace pmcd::admin {

class ProgressBar {
 public:
  /// `wanted` false: stays silent.
  ProgressBar(std::string title, bool wanted);
  ~ProgressBar() { clear(); }
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// `fraction` from 0 to 1. Drawn at most twenty times a second, and when the stage changes.
  void show(const std::string& stage, double fraction);
  /// Takes the line away, so that the next output stands on its own.
  void clear();

 private:
  std::string title_;
  bool on_;
  bool drawn_ = false;
  std::string stage_;
  std::chrono::steady_clock::time_point drawn_at_{};
};

}  // namespace pmcd::admin
