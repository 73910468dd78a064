// SPDX-License-Identifier: MIT
// Usage: serve_blobs FOLDER BYTES MESHES PACKETS. Writes meshes whose packets all have the given size, once as
// FOLDER/b<BYTES>-<mesh>.pmcd for pmcctl ingest, and once packet by packet as FOLDER/<BYTES>/<mesh>-<packet> for a web
// server. The packets are noise with right headers: what a daemon looks at, and no decoder takes.
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <random>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "codec/packet/directory.h"
#include "codec/packet/header.h"

namespace {

using namespace pmcd::codec;
using Packet = std::vector<std::byte>;
using Parts = std::vector<std::span<const std::byte>>;

struct Mesh {
  Directory directory;
  std::vector<Packet> packets;
};

/// The same seed gives the same bytes.
Mesh noise_mesh(std::uint64_t seed, std::size_t bytes, std::size_t count) {
  std::mt19937_64 random(seed);
  Mesh mesh;
  mesh.directory.format_version = kFormatVersion;
  mesh.directory.generation = random();
  for (std::size_t level = 0; level < count; ++level) {
    PacketHeader header;
    header.last = level + 1 == count;
    header.level = static_cast<std::uint32_t>(level);
    header.vertices = static_cast<std::uint32_t>(10 * (level + 1));
    header.faces = header.vertices * 2;
    header.mesh_hash = random();
    header.generation = mesh.directory.generation;
    Packet payload(bytes);
    for (std::byte& byte : payload) byte = static_cast<std::byte>(random() & 0xff);
    // The header's share of the size; where its number of payload bytes grows a digit, a packet may miss one byte.
    const std::size_t header_bytes = make_packet(header, payload).size() - bytes;
    Packet packet = make_packet(header, std::span<const std::byte>(payload).subspan(header_bytes));
    LevelEntry entry;
    entry.bytes = static_cast<std::uint32_t>(packet.size());
    entry.vertices = header.vertices;
    entry.faces = header.faces;
    entry.bits = static_cast<std::uint8_t>(mesh.directory.lattice.bits);
    entry.crc32c = parse_packet_header(packet).value().crc32c;
    mesh.directory.levels.push_back(entry);
    mesh.packets.push_back(std::move(packet));
  }
  return mesh;
}

void write(const std::filesystem::path& path, const Parts& parts) {
  std::ofstream file(path, std::ios::binary);
  for (const auto& part : parts) {
    file.write(reinterpret_cast<const char*>(part.data()), static_cast<std::streamsize>(part.size()));
  }
  file.close();
  if (!file) throw std::runtime_error(path.string() + " cannot be written");
}

void write_mesh(const std::filesystem::path& folder, const std::string& size, std::size_t number, const Mesh& mesh) {
  const std::vector<std::byte> directory = serialize(mesh.directory);
  Parts parts{directory};
  for (std::size_t packet = 0; packet < mesh.packets.size(); ++packet) {
    parts.emplace_back(mesh.packets[packet]);
    write(folder / size / (std::to_string(number) + "-" + std::to_string(packet)), {parts.back()});
  }
  write(folder / ("b" + size + "-" + std::to_string(number) + ".pmcd"), parts);
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 5) return 2;
  const std::filesystem::path folder = argv[1];
  const std::size_t bytes = std::stoull(argv[2]);
  const std::size_t meshes = std::stoull(argv[3]);
  const std::size_t packets = std::stoull(argv[4]);
  if (bytes < kMostHeaderBytes) return 2;
  std::filesystem::create_directories(folder / argv[2]);
  for (std::size_t number = 0; number < meshes; ++number) {
    write_mesh(folder, argv[2], number, noise_mesh(bytes + number, bytes, packets));
  }
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "serve_blobs: %s\n", error.what());
  return 1;
}
