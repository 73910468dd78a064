// SPDX-License-Identifier: GPL-3.0-or-later
// Amounts as a person reads them, in three digits and with a unit; "-" for none.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

namespace pmcd::admin {

std::string rate_text(std::optional<double> kbit_a_second);  ///< "33.6 kbit/s", "5.00 Mbit/s"
std::string bytes_text(std::optional<double> bytes);         ///< "812 B", "34.1 kB"
std::string seconds_text(std::optional<double> seconds);     ///< "0.12 s", "75.0 s", "3 h 5 min"
std::string share_text(std::optional<double> share);         ///< of 1: "12.3 %"
std::string weight_text(std::optional<double> weight);       ///< whole as it was given: "2.5", "12345.678"

/// "[####....]", `filled` of it from 0 to 1; what lies outside is cut. REQUIRES: width > 0.
std::string bar_text(double filled, std::size_t width);

}  // namespace pmcd::admin
