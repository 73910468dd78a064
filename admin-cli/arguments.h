// SPDX-License-Identifier: GPL-3.0-or-later
// Arguments of commands that have a form of their own: "name=value", numbers, weights. Knows no command line.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "proto/admin_rules.h"

namespace pmcd::admin {

/// "name=value", cut at the first "="; none without one, with nothing before it, or when a part is too long to be sent.
std::optional<proto::RuleOptionText> parse_option(std::string_view text);

/// Decimal digits and nothing else, as a number of 64 bits; none otherwise, also when it does not fit.
std::optional<std::uint64_t> parse_number(std::string_view text);

/// A weight "2" or "0.125" in thousandths; none if it is no such number, has more than three decimals, or does not lie
/// between 0.001 and 1000000.
std::optional<std::uint32_t> parse_weight(std::string_view text);

}  // namespace pmcd::admin
