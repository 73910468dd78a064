// SPDX-License-Identifier: MIT
#include "tests/fuzz/sample_meshes.h"

#include <optional>

#include "codec/encoder.h"
#include "tests/codec/generated.h"
#include "tests/fuzz/check.h"

namespace pmcd::fuzz {
namespace {

using namespace codec::testing;

std::vector<std::vector<std::byte>> packets_of(const codec::TriangleMesh& mesh, std::optional<unsigned> bits) {
  codec::EncodeOptions options;
  options.bits = bits;
  auto encoded = codec::encode(mesh, options);
  check(encoded.ok(), "a generated mesh is refused");
  std::vector<std::vector<std::byte>> packets;
  for (auto& packet : encoded->packets) packets.push_back(std::move(packet.bytes));
  return packets;
}

}  // namespace

const std::vector<std::vector<std::vector<std::byte>>>& sample_packets() {
  static const auto all = [] {
    Random random(7);
    codec::TriangleMesh mixed = joined(joined(sphere(1), grid(5, 5, 1)), tetrahedron());
    jitter(mixed, 0.02, random);
    add_isolated(mixed, 4, random);
    codec::TriangleMesh doubles = as_float64(torus(6, 5), random);
    return std::vector{packets_of(mixed, 10), packets_of(mixed, std::nullopt), packets_of(doubles, std::nullopt),
                       packets_of(holed_plate(1, 2), 12)};
  }();
  return all;
}

}  // namespace pmcd::fuzz
