// SPDX-License-Identifier: MIT
#include "tests/codec/support.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "codec/packet/bytes.h"
#include "codec/packet/crc32c.h"
#include "codec/packet/directory.h"
#include "codec/packet/header.h"
#include "codec/proof.h"

namespace pmcd::codec::testing {
namespace {

using PositionBits = std::array<std::uint64_t, 3>;

PositionBits bits_of(const Position& p) {
  return {std::bit_cast<std::uint64_t>(p[0]), std::bit_cast<std::uint64_t>(p[1]), std::bit_cast<std::uint64_t>(p[2])};
}

template <typename T>
void smallest_first(std::array<T, 3>& triple) {
  std::rotate(triple.begin(), std::min_element(triple.begin(), triple.end()), triple.end());
  // Equal entries: the least of the rotations that start with one.
  std::array<T, 3> turned = triple;
  for (int i = 0; i < 2; ++i) {
    std::rotate(turned.begin(), turned.begin() + 1, turned.end());
    triple = std::min(triple, turned);
  }
}

std::string at(const char* what, std::uint64_t where) {
  return std::string(what) + " " + std::to_string(where);
}

}  // namespace

std::string complaint(const HalfEdgeMesh& mesh) {
  std::vector<std::uint32_t> faces_at(mesh.vertex_count(), 0);
  std::vector<std::uint32_t> boundary_from(mesh.vertex_count(), 0);
  for (std::uint32_t f = 0; f < mesh.face_count(); ++f) {
    if (mesh.is_free_slot(f)) continue;
    for (std::uint32_t i = 0; i < 3; ++i) {
      const std::uint32_t h = HalfEdgeMesh::halfedge(f, i);
      const std::uint32_t v = mesh.origin(h);
      if (v >= mesh.vertex_count()) return at("corner out of range at half-edge", h);
      if (v == mesh.target(h)) return at("a face names a vertex twice at half-edge", h);
      ++faces_at[v];
      const std::uint32_t o = mesh.opposite(h);
      if (o == kNone) {
        ++boundary_from[v];
        continue;
      }
      if (HalfEdgeMesh::face_of(o) >= mesh.face_count() || HalfEdgeMesh::edge_of(o) > 2)
        return at("opposite out of range at half-edge", h);
      if (mesh.is_free_slot(HalfEdgeMesh::face_of(o))) return at("opposite in a free slot at half-edge", h);
      if (mesh.opposite(o) != h) return at("opposite not symmetric at half-edge", h);
      if (mesh.origin(o) != mesh.target(h) || mesh.target(o) != v)
        return at("opposite is another edge at half-edge", h);
    }
  }
  for (std::uint32_t v = 0; v < mesh.vertex_count(); ++v) {
    if (mesh.face_valence(v) != faces_at[v]) return at("wrong face valence at vertex", v);
    const std::uint32_t first = mesh.outgoing(v);
    if (faces_at[v] == 0) {
      if (first != kNone) return at("an isolated vertex has a half-edge, vertex", v);
      continue;
    }
    if (first == kNone || HalfEdgeMesh::face_of(first) >= mesh.face_count() || mesh.origin(first) != v)
      return at("outgoing half-edge of vertex", v);
    if (boundary_from[v] > 1) return at("more than one boundary half-edge leaves vertex", v);
    if ((boundary_from[v] == 1) != (mesh.opposite(first) == kNone)) return at("outgoing rule broken at vertex", v);
    std::uint32_t met = 0;
    std::uint32_t h = first;
    do {
      ++met;
      h = mesh.turn_left(h);
    } while (h != kNone && h != first && met <= faces_at[v]);
    if (met != faces_at[v]) return at("more than one fan at vertex", v);
  }
  return {};
}

std::vector<Face> sorted_faces(std::vector<Face> faces) {
  for (Face& face : faces) smallest_first(face);
  std::sort(faces.begin(), faces.end());
  return faces;
}

std::vector<Face> sorted_faces(const HalfEdgeMesh& mesh) {
  std::vector<Face> faces;
  for (std::uint32_t f = 0; f < mesh.face_count(); ++f) {
    if (!mesh.is_free_slot(f)) faces.push_back(mesh.face(f));
  }
  return sorted_faces(std::move(faces));
}

std::string difference(const TriangleMesh& wanted, const TriangleMesh& got) {
  if (wanted.scalar != got.scalar) return "the scalar types differ";
  if (wanted.positions.size() != got.positions.size()) return at("wrong number of vertices:", got.positions.size());
  if (wanted.faces.size() != got.faces.size()) return at("wrong number of faces:", got.faces.size());
  auto vertices = [](const TriangleMesh& mesh) {
    std::vector<PositionBits> all;
    for (const Position& p : mesh.positions) all.push_back(bits_of(p));
    std::sort(all.begin(), all.end());
    return all;
  };
  auto faces = [](const TriangleMesh& mesh) {
    std::vector<std::array<PositionBits, 3>> all;
    for (const Face& f : mesh.faces) {
      all.push_back({bits_of(mesh.positions[f[0]]), bits_of(mesh.positions[f[1]]), bits_of(mesh.positions[f[2]])});
      smallest_first(all.back());
    }
    std::sort(all.begin(), all.end());
    return all;
  };
  if (vertices(wanted) != vertices(got)) return "the positions differ";
  if (faces(wanted) != faces(got)) return "the faces differ";
  return {};
}

TriangleMesh snapped(const TriangleMesh& mesh, unsigned bits) {
  TriangleMesh result = mesh;
  if (mesh.positions.empty()) return result;
  Position low = mesh.positions[0];
  double extent = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double high = low[axis];
    for (const Position& p : mesh.positions) {
      if (p[axis] < low[axis]) low[axis] = p[axis];
      if (p[axis] > high) high = p[axis];
    }
    extent = std::max(extent, high - low[axis]);
  }
  const double most = std::pow(2.0, bits) - 1;
  double step = extent / most;
  if (extent > 0 && step == 0) step = 4.9406564584124654e-324;
  for (Position& p : result.positions) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double index = step == 0 ? 0 : std::min(most, std::floor((p[axis] - low[axis]) / step + 0.5));
      p[axis] = low[axis] + index * step;
      if (mesh.scalar == Scalar::float32) p[axis] = static_cast<double>(static_cast<float>(p[axis]));
    }
  }
  return result;
}

std::string decode_levels(std::span<const EncodedPacket> packets, TriangleMesh& result) {
  Decoder decoder;
  std::uint32_t before = 0;
  for (std::size_t k = 0; k < packets.size(); ++k) {
    const bool last = k + 1 == packets.size();
    Result<Level> level = decoder.apply(packets[k].bytes);
    if (!level) return at("packet", k) + ": " + text(level.error());
    if (level->level != k || level->last != last) return at("wrong level or last mark at packet", k);
    if (level->vertices != packets[k].vertices || level->faces != packets[k].faces)
      return at("counts not as announced at level", k);
    const TriangleMesh mesh = decoder.mesh();
    if (mesh.positions.size() != level->vertices || mesh.faces.size() != level->faces)
      return at("mesh of other size at level", k);
    Result<HalfEdgeMesh> built = HalfEdgeMesh::build(mesh.faces, mesh.positions.size());
    if (!built) return at("not manifold at level", k) + ": " + text(built.error());
    if (k > 0 && (level->vertices < before || (level->vertices == before && !last)))
      return at("vertices do not grow at level", k);
    before = level->vertices;
    if (last) result = mesh;
  }
  return {};
}

std::string round_trip(const TriangleMesh& mesh, const EncodeOptions& options, Encoded* encoded) {
  Result<Encoded> result = encode(mesh, options);
  if (!result) return "encode: " + text(result.error());
  const Status proven = prove(*result, mesh);
  if (!proven) return "prove: " + text(proven.error());
  TriangleMesh decoded;
  std::string broken = decode_levels(result->packets, decoded);
  if (broken.empty()) broken = difference(options.bits ? snapped(mesh, *options.bits) : mesh, decoded);
  if (encoded != nullptr) *encoded = std::move(result).value();
  return broken;
}

std::string text(const Error& error) {
  return std::string(error_name(error.code)) + " at " + std::to_string(error.where) + ": " + error.detail;
}

std::vector<std::span<const std::byte>> spans(const std::vector<EncodedPacket>& packets) {
  std::vector<std::span<const std::byte>> all;
  all.reserve(packets.size());
  for (const EncodedPacket& packet : packets) all.emplace_back(packet.bytes);
  return all;
}

std::vector<std::byte> to_file(const std::vector<EncodedPacket>& packets) {
  const Result<Directory> directory = make_directory(spans(packets));
  if (!directory) return {};
  std::vector<std::byte> file = serialize(*directory);
  for (const EncodedPacket& packet : packets) file.insert(file.end(), packet.bytes.begin(), packet.bytes.end());
  return file;
}

std::vector<std::byte> with_right_checksum(std::vector<std::byte> packet) {
  const std::span<const std::byte> bytes(packet);
  const std::uint32_t sum = crc32c(bytes.subspan(kHeaderNumbersOffset), crc32c(bytes.first(kHeaderChecksumOffset)));
  for (std::size_t i = 0; i < 4; ++i) {
    packet[kHeaderChecksumOffset + i] = static_cast<std::byte>((sum >> (8 * i)) & 0xFF);
  }
  return packet;
}

}  // namespace pmcd::codec::testing
