// SPDX-License-Identifier: GPL-3.0-or-later
// Drawing the bar.
#include "admin-cli/progress_bar.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <utility>

namespace pmcd::admin {

namespace {

constexpr std::size_t kBarWidth = 30;

std::size_t columns() {
  winsize size{};
  return ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1 ? size.ws_col : 80;
}

}  // namespace

ProgressBar::ProgressBar(std::string title, bool wanted)
    : title_(std::move(title)), on_(wanted && ::isatty(STDERR_FILENO) == 1) {}

void ProgressBar::show(const std::string& stage, double fraction) {
  if (!on_) return;
  const auto now = std::chrono::steady_clock::now();
  if (stage == stage_ && now < drawn_at_ + std::chrono::milliseconds(50)) return;
  stage_ = stage;
  drawn_at_ = now;
  drawn_ = true;
  const double clamped = std::clamp(fraction, 0.0, 1.0);
  const auto filled = static_cast<std::size_t>(clamped * static_cast<double>(kBarWidth));
  char percent[16];
  std::snprintf(percent, sizeof percent, "] %3d%% ", static_cast<int>(clamped * 100));
  std::string line = title_ + " [" + std::string(filled, '#') + std::string(kBarWidth - filled, '.') + percent + stage;
  line.resize(std::min(line.size(), columns() - 1));
  std::cerr << '\r' << line << "\x1b[K" << std::flush;
}

void ProgressBar::clear() {
  if (drawn_) std::cerr << "\r\x1b[K" << std::flush;
  drawn_ = false;
}

}  // namespace pmcd::admin
