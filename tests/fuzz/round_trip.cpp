// SPDX-License-Identifier: MIT
// The encoder, and the decoder behind it. The bytes choose options and build a small mesh: a shape, then changes to it,
// of which some break it. A mesh that no change may have broken is encoded, any other encoded or refused by name; what
// is encoded decodes level by level to the mesh, and the packets make a file.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <utility>

#include "codec/encoder.h"
#include "codec/packet/directory.h"
#include "codec/packet/header.h"
#include "codec/proof.h"
#include "tests/codec/generated.h"
#include "tests/codec/support.h"
#include "tests/fuzz/check.h"
#include "tests/fuzz/coordinates.h"
#include "tests/fuzz/script.h"

namespace pmcd::fuzz {
namespace {

using namespace codec::testing;
using codec::Scalar;
using codec::TriangleMesh;

constexpr std::size_t kMostVertices = 300;
constexpr int kMostChanges = 24;
constexpr double kLarge = 1e37;  // within both scalars' range, and so is twice of it

codec::EncodeOptions read_options(Script& script) {
  codec::EncodeOptions options;
  const std::uint8_t bits = script.below(23);
  if (bits >= 2) options.bits = bits + 2;  // 4 to 24
  const std::uint8_t flags = script.u8();
  options.cleaning = (flags & 1) != 0;
  if ((flags & 2) != 0) options.effort = codec::Effort::best;
  if ((flags & 4) != 0) options.max_packets_after_base = 1 + script.below(20);
  if ((flags & 8) != 0) options.min_flip_cosine = script.u8() / 127.5 - 1;
  if ((flags & 16) != 0) options.max_shape_error = script.u8() / 64.0;
  return options;
}

TriangleMesh read_shape(Script& script) {
  const std::uint8_t kind = script.below(12);
  const unsigned a = script.below(12);
  const unsigned b = script.below(12);
  switch (kind) {
    case 0:
      return grid(1 + a, 1 + b, script.below(8));
    case 1:
      return sphere(a % 3);
    case 2:
      return uv_sphere(2 + a, 3 + b);
    case 3:
      return torus(3 + a, 3 + b);
    case 4:
      return holed_plate(1 + a % 4, 1 + b % 2);
    case 5:
      return bipyramid(3 + 4 * a + b);
    case 6:
      return cone(3 + 4 * a + b);
    case 7:
      return facing_threes();
    case 8:
      return single_triangle();
    case 9:
      return tetrahedron();
    case 10:
      return octahedron();
    default:
      return {};
  }
}

class Maker {
 public:
  explicit Maker(Script& script) : script_(script), random_(script.u8()), mesh_(read_shape(script)) {}

  /// One change, of many or few coordinates or of the connectivity.
  void change() {
    const std::uint8_t kind = script_.below(20);
    const bool needs_manifold = kind <= 5 || kind == 9;
    if (needs_manifold && !manifold_) return;
    switch (kind) {
      case 0:
        join(1);
        break;
      case 1:
        join(1 + script_.below(40));
        break;
      case 2:
        split_faces(mesh_, script_.below(64), random_);
        break;
      case 3:
        flip_edges(mesh_, script_.u8(), random_);
        break;
      case 4:
        if (!mesh_.positions.empty()) add_isolated(mesh_, script_.below(40), random_);
        break;
      case 5:
        mesh_ = renumbered(mesh_, random_);
        break;
      case 6:
        jitter(mesh_, std::ldexp(1.0, -static_cast<int>(script_.below(30))), random_);
        break;
      case 7:
        mesh_ = as_float64(std::move(mesh_), random_);
        break;
      case 8:
        scale(script_.u8());
        break;
      case 9:
        squash(mesh_, script_.below(40), random_);
        break;
      case 10:
        sprinkle_zeros(mesh_, random_);
        break;
      case 11:
        flatten();
        break;
      case 12:
        to_grid();
        break;
      case 13:
        to_decimals();
        break;
      case 14:
        share_coordinates();
        break;
      case 15:
        move_one();
        break;
      case 16:
        remove_face();
        break;
      case 17:
        add_face();
        break;
      case 18:
        shift();
        break;
      default:
        add_vertex();
    }
  }

  [[nodiscard]] bool is_full() const { return mesh_.positions.size() > kMostVertices; }
  /// Whether nothing may have made it one that the encoder refuses.
  [[nodiscard]] bool is_sound() const {
    for (const codec::Position& p : mesh_.positions) {
      for (const double x : p) {
        if (!(std::abs(x) < kLarge) || rounded(x) != x) return false;
      }
    }
    return manifold_;
  }
  [[nodiscard]] const TriangleMesh& mesh() const { return mesh_; }

 private:
  [[nodiscard]] double rounded(double value) const {
    return mesh_.scalar == Scalar::float32 ? static_cast<double>(static_cast<float>(value)) : value;
  }
  template <typename Change>
  void each_coordinate(Change change) {
    for (codec::Position& p : mesh_.positions) {
      for (double& x : p) x = rounded(change(x));
    }
  }

  void join(unsigned times) {
    const TriangleMesh other = read_shape(script_);
    const double step = script_.below(5) * 0.75;
    for (unsigned i = 0; i < times && !is_full(); ++i) {
      TriangleMesh moved = other;
      for (codec::Position& p : moved.positions) p[i % 3] = rounded(p[i % 3] + step * (i + 1));
      mesh_ = joined(mesh_, moved);
    }
  }

  void scale(std::uint8_t by) { mesh_ = scaled(std::move(mesh_), std::ldexp(by % 2 == 0 ? 1.0 : 1.7, by - 150)); }

  void flatten() {
    const unsigned axis = script_.below(3);
    const double value = script_.u8() % 2 == 0 ? 0.5 : -0.0;
    for (codec::Position& p : mesh_.positions) p[axis] = value;
  }

  // Multiples of a power of ten or of any step; some of them moved off it.
  void to_grid() {
    const std::uint8_t kind = script_.u8();
    double step = kind % 2 == 0 ? 1.0 : 0.73 + kind;
    for (unsigned i = 0; i < kind / 2 % 6u; ++i) step /= 10;
    const std::uint8_t strays = script_.u8();
    each_coordinate([&](double x) { return strays > 0 && random_.one_in(strays) ? x : to_multiple(x, step); });
  }

  // So many significant digits, of all or some.
  void to_decimals() {
    const unsigned digits = 1 + script_.below(9);
    const std::uint8_t strays = script_.u8();
    each_coordinate([&](double x) { return strays > 0 && random_.one_in(strays) ? x : to_digits(x, digits); });
  }

  void share_coordinates() {
    if (mesh_.positions.empty()) return;
    const unsigned axis = script_.below(3);
    const std::uint8_t values = script_.u8();
    for (codec::Position& p : mesh_.positions) {
      p[axis] = mesh_.positions[random_.below(std::min<std::size_t>(1u + values, mesh_.positions.size()))][axis];
    }
  }

  void move_one() {
    if (mesh_.positions.empty()) return;
    const std::size_t vertex = script_.u16() % mesh_.positions.size();
    const std::uint8_t axis = script_.below(6);
    double value = 0;
    if (axis < 3) {
      value = static_cast<double>(std::bit_cast<float>(script_.u32()));
    } else {
      const std::uint64_t high = script_.u32();
      value = std::bit_cast<double>(high << 32 | script_.u32());
    }
    mesh_.positions[vertex][axis % 3] = value;
  }

  // What is left may hang together at a vertex only.
  void remove_face() {
    if (mesh_.faces.empty()) return;
    mesh_.faces.erase(mesh_.faces.begin() + script_.u16() % static_cast<std::ptrdiff_t>(mesh_.faces.size()));
    manifold_ = false;
  }

  void add_face() {
    const std::uint8_t a = script_.u8();
    const std::uint8_t b = script_.u8();
    mesh_.faces.push_back({a, b, script_.u8()});
    manifold_ = false;
  }

  void shift() {
    const unsigned axis = script_.below(3);
    const double whole = script_.u8();
    const double by = std::ldexp(whole, script_.below(60) - 30);
    for (codec::Position& p : mesh_.positions) p[axis] = rounded(p[axis] + by);
  }

  void add_vertex() {
    codec::Position p{};
    for (double& x : p) x = script_.u8() / 64.0 - 2;
    mesh_.positions.push_back(p);
  }

  Script& script_;
  Random random_;
  TriangleMesh mesh_;
  bool manifold_ = true;
};

bool is_about_the_mesh(codec::ErrorCode code) {
  return code >= codec::ErrorCode::index_out_of_range && code <= codec::ErrorCode::not_representable;
}

void check_packets(const codec::Encoded& encoded, const codec::EncodeOptions& options) {
  if (options.max_packets_after_base) {
    check(encoded.packets.size() <= *options.max_packets_after_base + 1, "more packets than were asked for");
  }
  for (const codec::EncodedPacket& packet : encoded.packets) {
    check(codec::check_packet(packet.bytes).ok(), "a packet that does not stand for itself");
  }
  const auto file = codec::parse_file(to_file(encoded.packets));
  if (!file) broken("the packets make no file: " + text(file.error()));
  check(file->packets.size() == encoded.packets.size(), "a file of other packets");
  check(file->directory.lossless == !options.bits, "a file that is lossless or not against what was asked for");
}

}  // namespace

void round_trip(Input input) {
  Script script(input);
  const codec::EncodeOptions options = read_options(script);
  Maker maker(script);
  for (int i = 0; i < kMostChanges && !script.empty() && !maker.is_full(); ++i) maker.change();
  const TriangleMesh& mesh = maker.mesh();

  const auto encoded = codec::encode(mesh, options);
  if (!encoded) {
    const codec::Error& error = encoded.error();
    if (maker.is_sound()) broken("a sound mesh is refused: " + text(error));
    if (!is_about_the_mesh(error.code)) broken("refused for no fault of the mesh: " + text(error));
    check(!error.detail.empty(), "an error without a word");
    return;
  }
  const codec::Status proven = codec::prove(*encoded, mesh);
  if (!proven) broken(text(proven.error()));
  check_packets(*encoded, options);
  TriangleMesh decoded;
  const std::string complaint = decode_levels(encoded->packets, decoded);
  if (!complaint.empty()) broken(complaint);
  const std::string unlike = difference(options.bits ? snapped(mesh, *options.bits) : mesh, decoded);
  if (!unlike.empty()) broken("the last level is not the mesh: " + unlike);
}

}  // namespace pmcd::fuzz
