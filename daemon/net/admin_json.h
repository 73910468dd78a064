// SPDX-License-Identifier: MIT
// The JSON of the admin channel's answers; proto/admin.h says which fields there are. It asks nobody anything.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/net/packet_cache.h"
#include "daemon/store/mesh_store.h"

namespace pmcd::net {

/// {"meshes":[...],"damaged":[{"name":...,"error":...},...]}
std::string list_json(const store::MeshList& list);
/// A mesh with "levels".
std::string show_json(const store::Mesh& mesh);
std::string removed_json(std::string_view name, std::uint64_t generation);

struct StatusReport {
  std::string version;
  std::string rule;
  std::optional<std::uint64_t> slots;  ///< none: as many as fill the uplink
  std::uint64_t sessions = 0;
  std::uint64_t session_limit = 0;
  std::uint64_t waiting = 0;
  std::uint64_t running = 0;
  std::uint64_t meshes = 0;
  std::uint64_t damaged_meshes = 0;
  std::string listen;
  std::uint16_t request_port = 0;
  std::uint16_t data_port = 0;
  std::int64_t started_at = 0;  ///< seconds since 1970
  std::int64_t uptime_seconds = 0;
  CacheStatus cache;
};
std::string status_json(const StatusReport& status);

/// RFC 3339 in UTC, for instance "2026-11-22T03:04:05Z".
std::string utc_time(std::int64_t seconds_since_1970);
/// 16 hex digits.
std::string generation_text(std::uint64_t generation);

}  // namespace pmcd::net
