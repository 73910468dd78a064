// SPDX-License-Identifier: GPL-3.0-or-later
// What pmcctl says about the queue and the clients: documents of proto/admin_rules.h to lines. Asks and prints nothing.
#pragma once

#include "admin-cli/document.h"

namespace pmcd::admin {

/// "3 waiting, 1 running".
std::string queue_counts(const ordered_json& queue);

/// The queue: the rule, the counts, a table of the requests, and how many are left out.
Lines queue_lines(const ordered_json& queue);

/// The clients, and what the uplink carries.
Lines clients_lines(const ordered_json& document);

/// Why a client is next, or is not.
Lines explain_lines(const ordered_json& document);

/// "client 7: weight 1 -> 2.5".
std::string weight_line(const ordered_json& document);

/// Packets of a mesh that are complete, of all that it has: "3/12", "-" without a mesh.
std::string level_text(const ordered_json& client);

/// A line for each request, and the head line before them. `marked`: a first column with "*" at those that are "mine".
Lines request_table(const ordered_json& requests, bool marked);

}  // namespace pmcd::admin
