// SPDX-License-Identifier: GPL-3.0-or-later
// What the person sees while a mesh is fetched: one live line on a terminal, else a line a level, on stderr.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "codec/packet/directory.h"

namespace pmcd::tool {

class FetchReport {
 public:
  FetchReport();

  /// Begins with this mesh, up to level `last`; also when it begins anew.
  void begin(const codec::Directory& directory, std::uint32_t last);

  /// Before a packet is waited for: time spent decoding and writing is no fault of the line.
  void waiting() { waiting_since_ = Clock::now(); }
  /// Bytes of packet `level` have come: `fresh` now, `received` in all.
  void chunk(std::uint32_t level, std::uint64_t received, std::uint64_t fresh);
  /// The packet is there.
  void arrived();
  /// Level `level` stands, fetched or from a file.
  void level(std::uint32_t level);

  /// Says something between the lines.
  void note(const std::string& text);
  /// Ends the live line so that what is printed next stands on its own.
  void leave_line();

  [[nodiscard]] double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

 private:
  using Clock = std::chrono::steady_clock;

  /// `standing`: the level whose shape is there already. Fields are two blanks apart; scripts read the long form.
  void show(std::uint32_t level, std::uint64_t bytes, std::optional<std::uint32_t> standing, const char* before,
            const char* after);
  [[nodiscard]] std::string shape_of(const codec::LevelEntry& entry) const;
  [[nodiscard]] double on_the_line() const;

  codec::Directory directory_;
  std::uint32_t last_ = 0;
  bool terminal_;
  bool open_line_ = false;
  std::uint64_t done_ = 0;   ///< bytes of the levels that stand
  std::uint64_t fresh_ = 0;  ///< bytes that came over the line
  Clock::time_point start_ = Clock::now();
  Clock::time_point shown_at_{};
  Clock::duration on_the_line_{0};
  std::optional<Clock::time_point> waiting_since_;
};

}  // namespace pmcd::tool
