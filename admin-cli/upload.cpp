// SPDX-License-Identifier: GPL-3.0-or-later
// The ingest of the admin protocol: begin, ready, data, commit, ok.
#include "admin-cli/upload.h"

#include <algorithm>
#include <optional>
#include <utility>

namespace pmcd::admin {

namespace {

using std::chrono::milliseconds;

constexpr milliseconds kReadyPatience{60'000};
constexpr milliseconds kCommitPatience{600'000};
constexpr std::uint32_t kIngestId = 1;

/// The daemon speaks only to refuse while data are under way.
std::optional<Failure> refused_meanwhile(AdminLine& line) {
  if (!line.has_news()) return std::nullopt;
  auto answer = line.receive(kReadyPatience);
  if (auto* failed = std::get_if<Failure>(&answer)) return std::move(*failed);
  return Failure{kRefused, proto::ErrorCode::none, "the daemon answered before it had everything"};
}

}  // namespace

std::variant<proto::IngestOk, Failure> upload(AdminLine& line, const std::string& name, bool replace,
                                              std::span<const std::byte> directory,
                                              const std::vector<std::span<const std::byte>>& packets,
                                              const UploadProgress& progress) {
  const proto::IngestBegin begin{kIngestId, replace, name, {directory.begin(), directory.end()}};
  if (auto failed = line.send(proto::encode(begin))) return *failed;
  auto ready = line.receive(kReadyPatience);
  if (auto* failed = std::get_if<Failure>(&ready)) return std::move(*failed);
  auto is_ready = read_as<proto::IngestReady>(std::get<Answer>(ready));
  if (auto* failed = std::get_if<Failure>(&is_ready)) return std::move(*failed);

  std::size_t total = 0;
  for (const auto& packet : packets) total += packet.size();
  std::size_t sent = 0;
  for (std::uint32_t k = 0; k < packets.size(); ++k) {
    for (std::size_t at = 0; at < packets[k].size();) {
      if (auto failed = refused_meanwhile(line)) return *failed;
      const auto piece = packets[k].subspan(at, std::min<std::size_t>(proto::kMaxChunkBytes, packets[k].size() - at));
      const auto header =
          proto::encode_ingest_data_header({kIngestId, k, at}, static_cast<std::uint32_t>(piece.size()));
      if (auto failed = line.send(header)) return *failed;
      if (auto failed = line.send(piece)) return *failed;
      at += piece.size();
      sent += piece.size();
      progress(static_cast<double>(sent) / static_cast<double>(total));
    }
  }
  if (auto failed = line.send(proto::encode(proto::IngestCommit{kIngestId}))) return *failed;
  auto committed = line.receive(kCommitPatience);
  if (auto* failed = std::get_if<Failure>(&committed)) return std::move(*failed);
  return read_as<proto::IngestOk>(std::get<Answer>(committed));
}

}  // namespace pmcd::admin
