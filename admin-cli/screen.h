// SPDX-License-Identifier: GPL-3.0-or-later
// The terminal of a live view: the alternate screen, without a cursor, while this object lives, and also left as it was
// found when a signal ends or stops the program. Draws lines that others made.
#pragma once

#include <chrono>
#include <csignal>

#include "admin-cli/watch_text.h"

namespace pmcd::admin {

/// At most one at a time.
class Screen {
 public:
  /// Whether standard output is a terminal that understands escapes.
  static bool possible();

  /// REQUIRES: possible(). Ctrl-C ends the program with kDone from now on.
  Screen();
  ~Screen();
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  /// As it is at present.
  [[nodiscard]] ScreenSize size() const;

  /// Puts the lines in the place of what was there, without flicker.
  void draw(const Lines& lines) const;

  /// Rests until then. False when it ended early, because the terminal may have another size or lost its picture.
  [[nodiscard]] bool rest_until(std::chrono::steady_clock::time_point end) const;

 private:
  sigset_t mask_before_{};
  sigset_t mask_at_rest_{};
};

}  // namespace pmcd::admin
