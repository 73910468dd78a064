// SPDX-License-Identifier: MIT
// The sharing out.
#include "daemon/net/descriptor_budget.h"

#include <algorithm>

namespace pmcd::net {

Limits fit_descriptors(Limits wanted, std::size_t descriptors) {
  const std::size_t free = descriptors - kOwnDescriptors;
  const std::size_t others = 2 * wanted.admin_connections + wanted.turned_away + wanted.spare_data_connections;
  const std::size_t beside_others = free > others ? (free - others) / 2 : 0;
  wanted.sessions = std::min(wanted.sessions, std::max(free / 4, beside_others));
  const std::size_t rest = std::min(others, free - 2 * wanted.sessions);
  const auto share = [rest, others](std::size_t count) { return std::max<std::size_t>(1, count * rest / others); };
  wanted.admin_connections = share(wanted.admin_connections);
  wanted.turned_away = share(wanted.turned_away);
  wanted.spare_data_connections = share(wanted.spare_data_connections);
  return wanted;
}

}  // namespace pmcd::net
