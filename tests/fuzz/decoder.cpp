// SPDX-License-Identifier: MIT
// The decoder. First byte: which generated mesh (or none), second: how many of its packets are applied; the rest is the
// next packet, whose magic, version, size and checksum are made right, so that what a fuzzer changes reaches the
// inside. Refused, it must leave the level as it was and let the right packet in; taken, it must be what it announces.
#include "codec/decoder.h"

#include <algorithm>
#include <array>
#include <vector>

#include "codec/packet/crc32c.h"
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

void put_u32(std::vector<std::byte>& bytes, std::size_t at, std::uint32_t value) {
  for (std::size_t i = 0; i < 4; ++i) bytes[at + i] = static_cast<std::byte>((value >> (8 * i)) & 0xff);
}

/// The bytes as a packet that is refused for nothing in its header but for its counts and hashes.
std::vector<std::byte> as_packet(Input bytes, std::uint32_t level) {
  std::vector<std::byte> packet(bytes.begin(), bytes.end());
  packet.resize(std::max(packet.size(), codec::kPacketHeaderBytes));
  static constexpr std::array kMagic{std::byte{'P'}, std::byte{'M'}, std::byte{'C'}, std::byte{'P'}};
  std::copy(kMagic.begin(), kMagic.end(), packet.begin());
  packet[4] = std::byte{codec::kFormatVersion};
  packet[5] = std::byte{static_cast<std::uint8_t>(level == 0 ? 0 : 1)};
  packet[6] &= std::byte{1};
  packet[7] = std::byte{0};
  put_u32(packet, 8, level);
  put_u32(packet, 12, static_cast<std::uint32_t>(packet.size() - codec::kPacketHeaderBytes));
  put_u32(packet, 40, 0);
  const Input all(packet);
  put_u32(packet, 44, codec::crc32c(all.subspan(codec::kPacketHeaderBytes), codec::crc32c(all.first(44))));
  return packet;
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
