// SPDX-License-Identifier: MIT
// Answers as JSON text.
#include "daemon/net/admin_json.h"

#include <array>
#include <ctime>
#include <nlohmann/json.hpp>

#include "proto/frame.h"

namespace pmcd::net {
namespace {

using Json = nlohmann::ordered_json;

std::string hex(std::uint64_t value, int digits) {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string text(static_cast<std::size_t>(digits), '0');
  for (auto it = text.rbegin(); it != text.rend(); ++it, value >>= 4) *it = kDigits[value & 0xf];
  return text;
}

Json measured(double error) {
  return error >= 0 ? Json(error) : Json(nullptr);
}

Json mesh_object(const store::MeshSummary& mesh) {
  return {{"name", mesh.name},
          {"generation", generation_text(mesh.generation)},
          {"vertices", mesh.vertices},
          {"faces", mesh.faces},
          {"packets", mesh.packets},
          {"bytes", mesh.bytes},
          {"lossless", mesh.lossless},
          {"bits", mesh.lattice.bits},
          {"scalar", mesh.lattice.scalar == codec::Scalar::float32 ? "float32" : "float64"},
          {"format_version", mesh.format_version},
          {"box_min", mesh.box_min},
          {"box_max", mesh.box_max},
          {"ingested_at", utc_time(mesh.added_at)}};
}

/// Names that are not UTF-8 cannot come in, but a database may be written by others: replaced, never thrown.
std::string text_of(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

std::string list_json(const store::MeshList& list) {
  Json meshes = Json::array();
  for (const store::MeshSummary& mesh : list.meshes) meshes.push_back(mesh_object(mesh));
  Json damaged = Json::array();
  for (const auto& [name, error] : list.damaged) damaged.push_back({{"name", name}, {"error", error.detail}});
  return text_of(Json{{"meshes", std::move(meshes)}, {"damaged", std::move(damaged)}});
}

std::string show_json(const store::Mesh& mesh) {
  Json object = mesh_object(mesh.summary);
  Json levels = Json::array();
  for (std::size_t level = 0; level < mesh.levels.size(); ++level) {
    const codec::LevelEntry& entry = mesh.levels[level];
    levels.push_back({{"level", level},
                      {"bytes", entry.bytes},
                      {"vertices", entry.vertices},
                      {"faces", entry.faces},
                      {"bits", entry.bits},
                      {"error_rms", measured(entry.error_rms)},
                      {"error_max", measured(entry.error_max)},
                      {"crc32c", hex(entry.crc32c, 8)}});
  }
  object["levels"] = std::move(levels);
  return text_of(object);
}

std::string removed_json(std::string_view name, std::uint64_t generation) {
  return text_of({{"removed", name}, {"generation", generation_text(generation)}});
}

std::string status_json(const StatusReport& status) {
  return text_of({{"version", status.version},
                  {"protocol", std::to_string(proto::kVersionMajor) + "." + std::to_string(proto::kVersionMinor)},
                  {"rule", status.rule},
                  {"slots", status.slots ? Json(*status.slots) : Json("auto")},
                  {"sessions", status.sessions},
                  {"session_limit", status.session_limit},
                  {"waiting", status.waiting},
                  {"running", status.running},
                  {"meshes", status.meshes},
                  {"damaged_meshes", status.damaged_meshes},
                  {"listen", status.listen},
                  {"request_port", status.request_port},
                  {"data_port", status.data_port},
                  {"started_at", utc_time(status.started_at)},
                  {"uptime_seconds", status.uptime_seconds},
                  {"cache_bytes", status.cache.bytes},
                  {"cache_limit_bytes", status.cache.limit_bytes},
                  {"cache_hits", status.cache.hits},
                  {"cache_misses", status.cache.misses}});
}

std::string utc_time(std::int64_t seconds_since_1970) {
  const auto seconds = static_cast<std::time_t>(seconds_since_1970);
  std::tm parts{};
  if (::gmtime_r(&seconds, &parts) == nullptr) return "1970-01-01T00:00:00Z";
  std::array<char, 64> text{};
  const std::size_t length = std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%SZ", &parts);
  return {text.data(), length};
}

std::string generation_text(std::uint64_t generation) {
  return hex(generation, 16);
}

}  // namespace pmcd::net
