// SPDX-License-Identifier: GPL-3.0-or-later
// What pmcctl says about the distribution rule: documents of proto/admin_rules.h to lines. Asks and prints nothing.
#pragma once

#include "admin-cli/document.h"

namespace pmcd::admin {

/// The rules with a line each, their options below, then the options that every rule has.
Lines rules_lines(const ordered_json& document);

/// The active rule: what is in force, where each value comes from, since when and by whom.
Lines rule_lines(const ordered_json& rule);

/// What set-rule or revert did, or would do: "rule: fifo slots=1 -> fcsf burst=2 slots=1".
std::string change_line(const ordered_json& document);

/// The warnings of set-rule or revert.
Lines change_warnings(const ordered_json& document);

/// Past changes, newest first, those that are damaged in their place.
Lines history_lines(const ordered_json& document);

}  // namespace pmcd::admin
