// SPDX-License-Identifier: MIT
// Uploads: what is checked when. The packets themselves are checked by MeshStore::insert, in the spool's memory map.
#include "daemon/store/upload.h"

#include <string>
#include <utility>
#include <vector>

namespace pmcd::store {
namespace {

std::string folder_of(const std::string& path) {
  const std::size_t slash = path.find_last_of('/');
  if (slash == std::string::npos) return ".";
  return slash == 0 ? "/" : path.substr(0, slash);
}

}  // namespace

Status UploadBudget::take(std::uint64_t bytes) {
  if (bytes > limits_.bytes_each) {
    return Error{ErrorCode::too_large, "the mesh has " + std::to_string(bytes) + " bytes of packets, at most " +
                                           std::to_string(limits_.bytes_each) + " are taken"};
  }
  if (taken_.fetch_add(bytes) + bytes > limits_.bytes_all) {
    taken_ -= bytes;
    return Error{ErrorCode::too_large, "the uploads under way leave no room for " + std::to_string(bytes) +
                                           " bytes more; try again when they have ended"};
  }
  return Done{};
}

Result<std::unique_ptr<Upload>> Upload::begin(MeshStore& store, std::shared_ptr<UploadBudget> budget,
                                              std::string_view name, bool replace,
                                              std::span<const std::byte> directory) {
  if (const Status status = check_name(name); !status.ok()) return status.error();
  auto parsed = codec::parse_directory(directory);
  if (!parsed) {
    return Error{ErrorCode::bad_directory,
                 std::string(codec::error_name(parsed.error().code)) + ": " + parsed.error().detail};
  }
  if (parsed->size != directory.size()) {
    return Error{ErrorCode::bad_directory, "bytes after the end of the directory"};
  }
  if (const Status status = check_directory(parsed->directory); !status.ok()) return status.error();
  if (!replace) {
    const auto taken = store.contains(name);
    if (!taken) return taken.error();
    if (taken.value()) return name_taken(name);
  }
  std::uint64_t bytes = 0;
  for (const codec::LevelEntry& level : parsed->directory.levels) bytes += level.bytes;
  if (const Status status = budget->take(bytes); !status.ok()) return status.error();
  std::unique_ptr<Upload> upload(new Upload(std::move(budget), name, replace, std::move(parsed->directory), bytes));
  auto spool = Spool::make(folder_of(store.path()));
  if (!spool) return spool.error();
  upload->spool_.emplace(std::move(spool).value());
  return upload;
}

Upload::~Upload() {
  budget_->give_back(bytes_);
}

Status Upload::append(std::uint32_t packet, std::uint64_t offset, std::span<const std::byte> bytes) {
  if (packet_ == directory_.levels.size()) {
    return Error{ErrorCode::bad_packet, "bytes came after the last packet was whole"};
  }
  if (packet != packet_ || offset != offset_) {
    return Error{ErrorCode::incomplete, "expected packet " + std::to_string(packet_) + " from byte " +
                                            std::to_string(offset_) + " on, got packet " + std::to_string(packet) +
                                            " from byte " + std::to_string(offset)};
  }
  const std::uint64_t left = directory_.levels[packet_].bytes - offset_;
  if (bytes.size() > left) {
    return Error{ErrorCode::bad_packet, "packet " + std::to_string(packet_) + " is longer than the directory says"};
  }
  if (Status status = spool_->append(bytes); !status.ok()) return status;
  offset_ += bytes.size();
  if (offset_ == directory_.levels[packet_].bytes) {
    ++packet_;
    offset_ = 0;
  }
  return Done{};
}

Result<Inserted> Upload::commit(MeshStore& store) {
  if (packet_ != directory_.levels.size()) {
    return Error{ErrorCode::incomplete, "the upload ends in packet " + std::to_string(packet_) + " at byte " +
                                            std::to_string(offset_) + ", before the last packet is whole"};
  }
  const auto mapped = spool_->map();
  if (!mapped) return mapped.error();
  std::vector<std::span<const std::byte>> packets;
  packets.reserve(directory_.levels.size());
  std::size_t at = 0;
  for (const codec::LevelEntry& level : directory_.levels) {
    packets.push_back(mapped.value().subspan(at, level.bytes));
    at += level.bytes;
  }
  return store.insert({name_, replace_, directory_, packets});
}

}  // namespace pmcd::store
