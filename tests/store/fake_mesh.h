// SPDX-License-Identifier: MIT
// Meshes for tests of store and daemon: packets with right headers and checksums whose payloads are seeded noise. They
// are what the daemon looks at; no decoder would take them.
#pragma once

#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "codec/packet/directory.h"
#include "codec/packet/header.h"

namespace pmcd::test {

struct FakeMesh {
  codec::Directory directory;
  std::vector<std::vector<std::byte>> packets;

  [[nodiscard]] std::vector<std::span<const std::byte>> spans() const { return {packets.begin(), packets.end()}; }
  [[nodiscard]] std::vector<std::byte> directory_bytes() const { return codec::serialize(directory); }
};

inline std::vector<std::byte> fake_packet(const codec::PacketHeader& header, std::size_t payload_bytes,
                                          std::mt19937_64& random) {
  std::vector<std::byte> payload(payload_bytes);
  for (std::byte& b : payload) b = static_cast<std::byte>(random() & 0xff);
  return codec::make_packet(header, payload);
}

/// A mesh with one packet for each payload size; the same seed gives the same bytes.
inline FakeMesh fake_mesh(std::uint64_t seed, const std::vector<std::size_t>& payload_bytes) {
  std::mt19937_64 random(seed);
  FakeMesh mesh;
  mesh.directory.format_version = codec::kFormatVersion;
  mesh.directory.lossless = seed % 2 == 0;
  mesh.directory.generation = random();
  mesh.directory.lattice.scalar = codec::Scalar::float64;
  mesh.directory.lattice.bits = 14;
  mesh.directory.lattice.min = {-1.5, 0.25, 3};
  mesh.directory.lattice.step = 1.0 / 1024;
  mesh.directory.box_min = {-1.5, 0.25, 3};
  mesh.directory.box_max = {2.5, 1.75, 4.125};
  for (std::size_t level = 0; level < payload_bytes.size(); ++level) {
    codec::PacketHeader header;
    header.last = level + 1 == payload_bytes.size();
    header.level = static_cast<std::uint32_t>(level);
    header.vertices = static_cast<std::uint32_t>(10 * (level + 1));
    header.faces = header.vertices * 2;
    header.missing_digits = static_cast<std::uint8_t>(std::min<std::size_t>(payload_bytes.size() - 1 - level, 10));
    header.mesh_hash = random();
    header.generation = mesh.directory.generation;
    mesh.packets.push_back(fake_packet(header, payload_bytes[level], random));
    codec::LevelEntry entry;
    entry.bytes = static_cast<std::uint32_t>(mesh.packets.back().size());
    entry.vertices = header.vertices;
    entry.faces = header.faces;
    entry.bits = static_cast<std::uint8_t>(mesh.directory.lattice.bits - header.missing_digits);
    entry.crc32c = codec::parse_packet_header(mesh.packets.back()).value().crc32c;
    if (level % 2 == 0) {
      // Values that come back from a serialised directory as they are.
      entry.error_rms = 0.5 / static_cast<double>(std::uint64_t{1} << (level % 32));
      entry.error_max = 0.75 / static_cast<double>(std::uint64_t{1} << (level % 32));
    }
    mesh.directory.levels.push_back(entry);
  }
  return mesh;
}

/// A new empty folder that goes with the object.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "pmcd-test-XXXXXX").string();
    path_ = ::mkdtemp(pattern.data());
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  [[nodiscard]] std::string file(const std::string& name) const { return path_ + "/" + name; }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace pmcd::test
