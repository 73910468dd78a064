// SPDX-License-Identifier: MIT
// How the descriptors that a process may have are shared among those who take them, so that nobody is let in for whom
// there is none, and the operator always gets in. Arithmetic only: it asks and changes nothing.
#pragma once

#include <cstddef>

#include "daemon/net/limits.h"

namespace pmcd::net {

/// Descriptors that are nobody's: the database and its journals, listeners, epoll, timers, log (17 when measured), a
/// connection that was accepted and is not judged yet, and what libraries open in passing.
inline constexpr std::size_t kOwnDescriptors = 32;
/// With fewer there is not one session, one admin connection with an upload, and a word for those beyond.
inline constexpr std::size_t kFewestDescriptors = kOwnDescriptors + 6;

/// Of a session: two connections. Of an admin connection: itself and the spool of its upload.
[[nodiscard]] constexpr std::size_t descriptors_used(const Limits& limits) {
  return kOwnDescriptors + 2 * limits.sessions + 2 * limits.admin_connections + limits.turned_away +
         limits.spare_data_connections;
}

/// `wanted` with the counts of connections lowered as far as `descriptors` demands: first the sessions, down to half of
/// all; where that is not enough, the others too, each in proportion and none below 1.
/// REQUIRES: descriptors >= kFewestDescriptors, and every count in `wanted` at least 1.
/// ENSURES: descriptors_used(result) <= descriptors, and no count is above that of `wanted`.
[[nodiscard]] Limits fit_descriptors(Limits wanted, std::size_t descriptors);

}  // namespace pmcd::net
