// SPDX-License-Identifier: MIT
#include "tests/fuzz/sample_meshes.h"

#include <optional>

#include "codec/encoder.h"
#include "tests/codec/generated.h"
#include "tests/fuzz/check.h"
#include "tests/fuzz/coordinates.h"

namespace pmcd::fuzz {
namespace {

using namespace codec::testing;

std::vector<std::vector<std::byte>> packets_of(const codec::TriangleMesh& mesh, std::optional<unsigned> bits,
                                               codec::Effort effort = codec::Effort::standard) {
  codec::EncodeOptions options;
  options.bits = bits;
  options.effort = effort;
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
    std::vector samples{packets_of(mixed, 10), packets_of(mixed, std::nullopt), packets_of(doubles, std::nullopt),
                        packets_of(holed_plate(1, 2), 12)};

    // Levels of more and more digits, with either effort; a mesh that repeats coordinates.
    codec::TriangleMesh smooth = sphere(3);
    jitter(smooth, 0.01, random);
    samples.push_back(packets_of(smooth, 16));
    samples.push_back(packets_of(smooth, 12, codec::Effort::best));
    samples.push_back(packets_of(grid(12, 12, 3), 11, codec::Effort::best));

    // What lossless coordinates are made of: whole multiples, decimals, some of few digits, a stepped grid, decimals
    // that were moved, few values.
    const auto lossless = [&](auto&& change) {
      codec::TriangleMesh mesh = smooth;
      for (codec::Position& p : mesh.positions) {
        for (double& x : p) x = static_cast<double>(static_cast<float>(change(x)));
      }
      samples.push_back(packets_of(mesh, std::nullopt));
    };
    lossless([](double x) { return to_multiple(x, 1.0 / 1024); });
    lossless([](double x) { return to_digits(x, 6); });
    lossless([&](double x) { return to_digits(x, random.one_in(3) ? 6 : 3); });
    lossless([](double x) { return to_multiple(x, 1.2745e-4) + 4e-5; });
    lossless([](double x) { return static_cast<double>(static_cast<float>(to_digits(x, 5)) + 3.7F) - 3.7F; });
    const codec::TriangleMesh values = smooth;
    lossless([&](double) { return values.positions[random.below(12)][0]; });
    return samples;
  }();
  return all;
}

}  // namespace pmcd::fuzz
