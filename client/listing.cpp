// SPDX-License-Identifier: MIT
// The mesh list: one page, and all pages one after the other.
#include <utility>

#include "client/failed_transfer.h"
#include "client/session_core.h"

namespace pmcd::client {

Result<proto::MeshPage> Session::list_page(const std::string& filter, const std::string& after, std::uint16_t most) {
  const auto id = core_->start_request(proto::kMaxMeshPageBytes);
  if (!id) return id.error();
  core_->transfer(*id)->expect(0, 0, std::nullopt);
  core_->send_request(proto::encode(proto::GetMeshList{*id, filter, after, most}));
  const auto ended = [&] {
    const Transfer* transfer = core_->transfer(*id);
    return transfer == nullptr || transfer->ended();
  };
  if (auto error = core_->wait(ended)) return *error;
  if (auto refusal = core_->take_refusal(*id)) return *refusal;
  const proto::TransferEnd end = core_->transfer(*id)->end();
  const proto::Bytes bytes = core_->transfer(*id)->take_bytes();
  core_->drop(*id);
  if (end.result == proto::TransferResult::failed) return failed_transfer(end);
  if (end.result != proto::TransferResult::complete) return core_->fail(failed_transfer(end));
  auto page = proto::decode_mesh_page(bytes);
  if (!page) {
    return core_->fail(
        {Failure::violation, proto::ErrorCode::none, "the server broke the protocol: " + page.error().detail});
  }
  return std::move(page).value();
}

Result<std::vector<proto::MeshListEntry>> Session::list(const std::string& filter) {
  std::vector<proto::MeshListEntry> entries;
  for (std::string after;;) {
    auto page = list_page(filter, after, 0);
    if (!page) return page.error();
    const bool last = page->remaining == 0;
    if (!last && page->entries.empty()) {
      return core_->fail({Failure::violation, proto::ErrorCode::none,
                          "the server broke the protocol: an empty page of the mesh list that is not the last"});
    }
    for (proto::MeshListEntry& entry : page->entries) {
      if (!after.empty() && entry.name <= after) {
        return core_->fail({Failure::violation, proto::ErrorCode::none,
                            "the server broke the protocol: a page of the mesh list goes back"});
      }
      entries.push_back(std::move(entry));
    }
    if (last) return entries;
    after = entries.back().name;
  }
}

}  // namespace pmcd::client
