// SPDX-License-Identifier: MIT
// The decoder. First byte: which generated mesh (or none), second: how many of its packets are applied; the rest is the
// next packet, whose magic, version, level, size and checksum are made right, so that what a fuzzer changes reaches the
// inside. Refused, it must leave the level as it was and let the right packet in; taken, it must be what it announces.
#include "codec/decoder.h"

#include <algorithm>
#include <vector>

#include "codec/packet/header.h"
#include "tests/fuzz/check.h"
#include "tests/fuzz/sample_meshes.h"
#include "tests/fuzz/script.h"

namespace pmcd::fuzz {
namespace {

using codec::DecoderLimits;

DecoderLimits small_limits() {
  DecoderLimits limits;
  limits.max_vertices = 2'000;
  limits.max_faces = 4'000;
  limits.max_packet_bytes = 64 * 1024;
  return limits;
}

/// The bytes as a packet that is refused for nothing in its header but for its counts and hashes.
std::vector<std::byte> as_packet(Input bytes, std::uint32_t level) {
  std::vector<std::byte> packet(bytes.begin(), bytes.end());
  packet.resize(std::max(packet.size(), codec::kLeastHeaderBytes));
  packet[0] = std::byte{codec::kPacketMagic};
  packet[1] &= std::byte{0x0F};
  if ((packet[1] & std::byte{1}) != std::byte{0}) packet[1] = std::byte{1};  // the last level lacks no digits
  const auto read = codec::parse_packet_header(packet);
  codec::PacketHeader header = read ? *read : codec::PacketHeader{};
  if (!read) {
    header.last = packet[1] == std::byte{1};
    header.size = codec::kLeastHeaderBytes;
  }
  header.level = level;
  return codec::make_packet(header, Input(packet).subspan(header.size));
}

void check_level(const codec::Decoder& decoder, const codec::PacketHeader& header, const codec::Level& level) {
  check(level.vertices == header.vertices && level.faces == header.faces && level.level == header.level,
        "a level that is not what its packet announced");
  const codec::TriangleMesh mesh = decoder.mesh();
  check(mesh.positions.size() == level.vertices && mesh.faces.size() == level.faces, "a mesh of other counts");
  for (const codec::Face& face : mesh.faces) {
    for (const std::uint32_t vertex : face) check(vertex < mesh.positions.size(), "a face without its vertex");
    check(face[0] != face[1] && face[1] != face[2] && face[2] != face[0], "a face with a vertex twice");
  }
}

bool same_mesh(const codec::TriangleMesh& a, const codec::TriangleMesh& b) {
  return a.faces == b.faces && a.positions == b.positions;
}

}  // namespace

void decoder(Input input) {
  Script script(input);
  const auto& samples = sample_packets();
  const std::size_t choice = script.u8() % (samples.size() + 1);
  std::size_t applied = script.u8();
  codec::Decoder decoder(small_limits());
  const std::vector<std::vector<std::byte>> none;
  const auto& sample = choice == 0 ? none : samples[choice - 1];
  applied = sample.empty() ? 0 : applied % sample.size();
  for (std::size_t k = 0; k < applied; ++k) check(decoder.apply(sample[k]).ok(), "an honest packet is refused");
  const codec::TriangleMesh before = applied > 0 ? decoder.mesh() : codec::TriangleMesh();

  const std::vector<std::byte> packet = as_packet(script.rest(), static_cast<std::uint32_t>(applied));
  const auto level = decoder.apply(packet);
  if (level) {
    const auto header = codec::check_packet(packet);
    check(header.ok(), "a packet was taken that is none");
    check_level(decoder, *header, *level);
    return;
  }
  check(level.error().code != codec::ErrorCode::internal_error, "an internal error");
  check(!level.error().detail.empty(), "an error without a word");
  check(decoder.has_level() == (applied > 0), "a refused packet changes the level");
  if (applied > 0) check(same_mesh(decoder.mesh(), before), "a refused packet changes the mesh");
  if (!sample.empty()) check(decoder.apply(sample[applied]).ok(), "the right packet is refused after a wrong one");
}

}  // namespace pmcd::fuzz
