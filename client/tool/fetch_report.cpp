// SPDX-License-Identifier: GPL-3.0-or-later
// The live line and the lines of levels.
#include "client/tool/fetch_report.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <iostream>

namespace pmcd::tool {

namespace {

std::string amount(double bytes) {
  const char* unit = "B";
  for (const char* larger : {"kB", "MB", "GB"}) {
    if (bytes < 1000) break;
    bytes /= 1000;
    unit = larger;
  }
  char text[32];
  std::snprintf(text, sizeof text, unit[0] == 'B' ? "%.0f %s" : "%.1f %s", bytes, unit);
  return text;
}

/// Columns of the terminal on stderr: a longer line would wrap and could not be overwritten.
std::size_t columns() {
  winsize size{};
  return ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1 ? size.ws_col : 80;
}

}  // namespace

FetchReport::FetchReport() : terminal_(::isatty(STDERR_FILENO) == 1) {}

void FetchReport::begin(const codec::Directory& directory, std::uint32_t last) {
  directory_ = directory;
  last_ = last;
  done_ = 0;
}

void FetchReport::chunk(std::uint32_t level, std::uint64_t received, std::uint64_t fresh) {
  fresh_ += fresh;
  const auto now = Clock::now();
  if (!terminal_ || now < shown_at_ + std::chrono::milliseconds(50)) return;
  shown_at_ = now;
  show(level, done_ + received, level == 0 ? std::nullopt : std::optional(level - 1), "\r", "\x1b[K");
}

void FetchReport::arrived() {
  if (waiting_since_) on_the_line_ += Clock::now() - *waiting_since_;
  waiting_since_.reset();
}

void FetchReport::level(std::uint32_t level) {
  done_ += directory_.levels[level].bytes;
  show(level, done_, level, terminal_ ? "\r" : "", terminal_ ? (level == last_ ? "\x1b[K\n" : "\x1b[K") : "\n");
  open_line_ = terminal_ && level != last_;
}

void FetchReport::note(const std::string& text) {
  leave_line();
  std::cerr << "pmctool fetch: " << text << std::endl;
}

void FetchReport::leave_line() {
  if (open_line_) std::cerr << '\n';
  open_line_ = false;
}

void FetchReport::show(std::uint32_t level, std::uint64_t bytes, std::optional<std::uint32_t> standing,
                       const char* before, const char* after) {
  std::string line = "level " + std::to_string(level) + "/" + std::to_string(directory_.levels.size() - 1) + "  " +
                     amount(static_cast<double>(bytes));
  if (standing) line += shape_of(directory_.levels[*standing]);
  char time[32];
  std::snprintf(time, sizeof time, "  %.2f s  ", seconds());
  line += time + amount(static_cast<double>(fresh_) / std::max(on_the_line(), 1e-6)) + "/s";
  if (terminal_) line.resize(std::min(line.size(), columns() - 1));
  std::cerr << before << line << after << std::flush;
  open_line_ = terminal_;
}

/// Short on a terminal, where the line must not wrap: error is RMS there.
std::string FetchReport::shape_of(const codec::LevelEntry& entry) const {
  std::string shape = "  " + std::to_string(entry.vertices) + " vertices";
  if (!terminal_) shape += "  " + std::to_string(entry.faces) + " faces";
  if (entry.error_rms < 0) return shape;
  char text[64];
  if (terminal_) {
    std::snprintf(text, sizeof text, "  error %.3g%%", 100 * entry.error_rms);
  } else {
    std::snprintf(text, sizeof text, "  error %.3g%% rms %.3g%% max", 100 * entry.error_rms, 100 * entry.error_max);
  }
  return shape + text;
}

double FetchReport::on_the_line() const {
  const Clock::duration now = waiting_since_ ? Clock::now() - *waiting_since_ : Clock::duration::zero();
  return std::chrono::duration<double>(on_the_line_ + now).count();
}

}  // namespace pmcd::tool
