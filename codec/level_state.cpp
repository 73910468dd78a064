// SPDX-License-Identifier: MIT
#include "codec/level_state.h"

#include <bit>

#include "codec/packet/hash.h"

namespace pmcd::codec {

std::uint64_t mesh_hash(const LevelState& state) {
  Hash64 hash;
  // What the numbers mean is part of the mesh.
  hash.add((std::uint64_t{state.lattice.bits} << 2) | (state.lattice.scalar == Scalar::float64 ? 2u : 0u) |
           (state.lossless ? 1u : 0u));
  for (double value : state.lattice.min) hash.add(std::bit_cast<std::uint64_t>(value));
  hash.add(std::bit_cast<std::uint64_t>(state.lattice.step));
  if (state.lattice.unit) {
    hash.add((std::uint64_t{state.lattice.unit->multiple} << 32) |
             (std::uint64_t{static_cast<std::uint16_t>(state.lattice.unit->exponent)} << 1) |
             (state.lattice.exact ? 1u : 0u));
    for (std::int64_t k : state.lattice.origin) hash.add(static_cast<std::uint64_t>(k));
  }
  hash.add(state.points.size());
  hash.add(state.mesh.face_count());
  for (const LatticePoint& p : state.points) {
    hash.add((std::uint64_t{static_cast<std::uint32_t>(p[0])} << 32) | static_cast<std::uint32_t>(p[1]));
    hash.add(static_cast<std::uint32_t>(p[2]));
  }
  for (std::uint32_t f = 0; f < state.mesh.face_count(); ++f) {
    const Face face = state.mesh.face(f);
    hash.add((std::uint64_t{face[0]} << 32) | face[1]);
    hash.add(face[2]);
  }
  for (const Position& p : state.exact) {
    for (double value : p) hash.add(std::bit_cast<std::uint64_t>(value));
  }
  return hash.value();
}

TriangleMesh to_triangle_mesh(const LevelState& state) {
  TriangleMesh mesh;
  mesh.scalar = state.lattice.scalar;
  if (!state.exact.empty()) {
    mesh.positions = state.exact;
  } else {
    mesh.positions.reserve(state.points.size());
    for (const LatticePoint& p : state.points) mesh.positions.push_back(state.lattice.position_of_middle(p));
  }
  mesh.faces.reserve(state.mesh.face_count());
  for (std::uint32_t f = 0; f < state.mesh.face_count(); ++f) mesh.faces.push_back(state.mesh.face(f));
  return mesh;
}

}  // namespace pmcd::codec
