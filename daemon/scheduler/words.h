// SPDX-License-Identifier: MIT
// Numbers as a person reads them in the reasons of rules: few digits, with a unit.
#pragma once

#include <cstdint>
#include <string>

#include "daemon/scheduler/request.h"

namespace pmcd::scheduler {

std::string seconds_text(double seconds);     ///< "0.12 s", "3.4 s", "75 s"
std::string age_text(Time since, Time now);   ///< the same for a span that is not negative
std::string bytes_text(std::uint64_t bytes);  ///< "812 B", "34.1 kB"
std::string number_text(double number);       ///< three digits that count

}  // namespace pmcd::scheduler
