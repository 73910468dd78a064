// SPDX-License-Identifier: GPL-3.0-or-later
// One picture of the live view: three documents to the lines that fit a terminal. Asks nothing, and writes no escapes.
#pragma once

#include <cstddef>
#include <optional>

#include "admin-cli/document.h"

namespace pmcd::admin {

/// What the daemon answered at one time.
struct Snapshot {
  ordered_json rule;     ///< R
  ordered_json clients;  ///< of `clients`
  ordered_json queue;    ///< of `queue`
};

/// Room for a picture; none: as much as it takes.
struct ScreenSize {
  std::optional<std::size_t> columns;
  std::optional<std::size_t> rows;
};

/// At most size.rows lines of at most size.columns characters: the rule and the uplink, the clients (those that are
/// served first, then those that wait), the queue from its head. Where not all fits, a line says how many more there
/// are; clients take at most half of the room as long as the queue can use the other.
Lines snapshot_lines(const Snapshot& snapshot, const ScreenSize& size);

}  // namespace pmcd::admin
