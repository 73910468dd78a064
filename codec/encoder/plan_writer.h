// SPDX-License-Identifier: MIT
// The Source that writes instead of reads (see source.h): it answers every question of the shared decoding functions
// from the encoder's records, writes the answer, and keeps account of which decoder vertex is which original one.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "codec/encoder.h"
#include "codec/encoder/encoding_plan.h"
#include "codec/encoder/spending.h"
#include "codec/encoder/variant.h"
#include "codec/geometry/reflection.h"
#include "codec/mesh/halfedge_mesh.h"
#include "codec/source.h"

namespace pmcd::codec {

/// What one packet is to hold.
struct PacketPlan {
  std::span<const PassRecord> passes;  ///< coarse to fine
  Spending spending;
  bool with_isolated = false;
  bool with_exactness = false;
};

/// Writes one packet's coded part.
class PlanWriter {
 public:
  /// `variant` is told which decoder vertex is which, and where the bits went.
  PlanWriter(const EncodingPlan& plan, const Descent& descent, const PacketPlan& packet, Variant& variant,
             std::vector<std::byte>& out)
      : plan_(plan), descent_(descent), packet_(packet), variant_(variant), encoder_(out) {}

  bool bit(AdaptiveBit& model, bool value) {
    encoder_.bit(model, value);
    return value;
  }
  bool bit_at(std::uint32_t p0, bool value) {
    encoder_.bit_at(p0, value);
    return value;
  }
  std::uint32_t raw(std::uint32_t value, unsigned count) {
    if (count > 0) encoder_.raw(value, count);
    return value;
  }
  std::uint32_t uniform(std::uint32_t value, std::uint32_t count) {
    encoder_.uniform(value, count);
    return value;
  }
  template <typename Guess, typename Cumulative>
  std::uint32_t symbol(std::uint32_t value, std::uint32_t count, const Guess& /*guess*/, const Cumulative& cumulative) {
    const std::uint32_t low = cumulative(value);
    encoder_.part(low, cumulative(value + 1) - low, cumulative(count));
    return value;
  }
  [[nodiscard]] static bool failed() { return false; }
  void finish() { encoder_.finish(); }

  [[nodiscard]] Guessing wanted_guessing() const { return packet_.spending.guessing; }
  [[nodiscard]] std::uint32_t wanted_clear() const { return packet_.spending.clear; }
  [[nodiscard]] Structure wanted_structure() const { return packet_.spending.structure; }
  [[nodiscard]] Reflection wanted_reflection() const { return plan_.reflection; }
  [[nodiscard]] std::uint32_t wanted_passes() const { return static_cast<std::uint32_t>(packet_.passes.size()); }
  [[nodiscard]] PassKind wanted_pass_kind() const { return packet_.passes[pass_].kind; }
  /// Whether an ear stands beyond the boundary edge that leaves this vertex; told_inserted then means that ear.
  bool wanted_ear(std::uint32_t edge_origin) {
    const auto& bases = packet_.passes[pass_].ear_base;
    const auto found = std::lower_bound(bases.begin(), bases.end(), variant_.to_original[edge_origin]);
    if (found == bases.end() || *found != variant_.to_original[edge_origin]) return false;
    next_removed_ = static_cast<std::size_t>(found - bases.begin());
    return true;
  }
  Symbol wanted_symbol() {
    // A walk that went another way than the recorded one would run out: an impossible symbol ends it.
    const auto& symbols = packet_.passes[pass_].symbols;
    return next_symbol_ < symbols.size() ? symbols[next_symbol_++] : kImpossible;
  }
  [[nodiscard]] LatticePoint wanted_point(std::uint32_t vertex) const {
    return plan_.points[variant_.to_original[vertex]];
  }
  [[nodiscard]] std::uint32_t wanted_components() const { return static_cast<std::uint32_t>(descent_.seeds.size()); }
  [[nodiscard]] bool wanted_boundary() const;
  /// The base's coordinates of one axis as cells of 2^shift, ascending, if they repeat enough to be worth a list.
  [[nodiscard]] std::vector<std::int32_t> wanted_values(std::size_t axis, unsigned shift) const;
  [[nodiscard]] BaseStep wanted_beyond(std::uint32_t halfedge) const;
  [[nodiscard]] std::uint32_t wanted_isolated() const {
    return packet_.with_isolated ? static_cast<std::uint32_t>(plan_.isolated.size()) : 0;
  }
  [[nodiscard]] LatticePoint wanted_isolated_point(std::uint32_t k) const { return plan_.points[plan_.isolated[k]]; }
  [[nodiscard]] std::optional<ExactnessForm> wanted_exactness() const {
    return packet_.with_exactness ? std::optional<ExactnessForm>(plan_.form) : std::nullopt;
  }
  /// Whether a coordinate is this value, bit for bit.
  [[nodiscard]] bool wanted_exact(std::uint32_t vertex, std::size_t axis, double value) const {
    return std::bit_cast<std::uint64_t>(original(vertex, axis)) == std::bit_cast<std::uint64_t>(value);
  }
  /// Whether it is one of the cell's.
  [[nodiscard]] bool wanted_in(std::uint32_t vertex, std::size_t axis, const Cell& cell) const {
    return wanted_exact(vertex, axis, cell.value(cell.nearest(original(vertex, axis))));
  }
  [[nodiscard]] std::uint64_t wanted_number(std::uint32_t vertex, std::size_t axis, const Cell& cell) const {
    return cell.nearest(original(vertex, axis));
  }
  /// How many floats after `value` it comes, modulo 2^64.
  [[nodiscard]] std::int64_t wanted_stray(std::uint32_t vertex, std::size_t axis, double value) const {
    const Scalar scalar = plan_.original->scalar;
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(to_ordered(original(vertex, axis), scalar)) -
                                     static_cast<std::uint64_t>(to_ordered(value, scalar)));
  }

  void told_pass(std::uint32_t pass) {
    pass_ = pass;
    next_symbol_ = 0;
    next_removed_ = 0;
  }
  void told_inserted(std::uint32_t /*vertex*/) {
    variant_.to_original.push_back(packet_.passes[pass_].removed[next_removed_++]);
  }
  void told_component(std::uint32_t component, std::uint32_t first_vertex, std::uint32_t face);
  void told_face(std::uint32_t beyond, std::uint32_t face, std::uint32_t vertex);
  void told_isolated(std::uint32_t k, std::uint32_t /*vertex*/) { variant_.to_original.push_back(plan_.isolated[k]); }
  void told_part(PacketPart part);

 private:
  [[nodiscard]] std::uint32_t planned(std::uint32_t decoder_halfedge) const {
    std::uint32_t h = base_first_[decoder_halfedge / 3];
    for (std::uint32_t i = decoder_halfedge % 3; i > 0; --i) h = HalfEdgeMesh::next(h);
    return h;
  }

  // The decoder's next face begins with this half-edge of the base.
  void tell(std::uint32_t first) {
    std::uint32_t number = 3 * static_cast<std::uint32_t>(base_first_.size());
    base_first_.push_back(first);
    for (int i = 0; i < 3; ++i, first = HalfEdgeMesh::next(first)) told_[first] = number++;
  }

  [[nodiscard]] double original(std::uint32_t vertex, std::size_t axis) const {
    return plan_.original->positions[variant_.to_original[vertex]][axis];
  }

  const EncodingPlan& plan_;
  const Descent& descent_;
  PacketPlan packet_;
  Variant& variant_;
  RangeEncoder encoder_;
  std::size_t pass_ = 0;
  std::size_t next_symbol_ = 0;
  std::size_t next_removed_ = 0;
  double counted_bits_ = 0;
  std::vector<std::uint32_t> base_first_;  ///< by decoder face: the base's half-edge that is its first
  std::vector<std::uint32_t> told_;        ///< by half-edge of the base: the decoder's, kNone while not told
  std::vector<std::uint32_t> to_decoder_;  ///< by vertex of the base
};

inline bool PlanWriter::wanted_boundary() const {
  for (std::uint32_t f = 0; f < descent_.base.face_count(); ++f) {
    if (descent_.base.boundary_edges(f) > 0) return true;
  }
  return false;
}

inline std::vector<std::int32_t> PlanWriter::wanted_values(std::size_t axis, unsigned shift) const {
  std::vector<std::int32_t> values;
  for (std::uint32_t v : descent_.base_vertices) values.push_back(plan_.points[v][axis] >> shift);
  const std::size_t vertices = values.size();
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  // The list costs a few bits a value more than it saves at its first use.
  constexpr std::size_t kUses = 4;
  if (values.size() * kUses > vertices) values.clear();
  return values;
}

inline BaseStep PlanWriter::wanted_beyond(std::uint32_t halfedge) const {
  const HalfEdgeMesh& base = descent_.base;
  const std::uint32_t across = base.opposite(planned(halfedge));
  if (across == kNone) return {BaseStep::Kind::boundary, kNone, false};
  if (to_decoder_[base.apex(across)] == kNone) return {BaseStep::Kind::new_vertex, kNone, false};
  // The face's neighbour around the known vertex, first on the side of the gate's origin.
  std::uint32_t h = base.opposite(HalfEdgeMesh::next(across));
  while (h != kNone && told_[h] == kNone) h = base.turn_left(h);
  if (h != kNone) return {BaseStep::Kind::known_vertex, told_[h], false};
  h = base.opposite(HalfEdgeMesh::prev(across));
  while (h != kNone && told_[h] == kNone) h = base.opposite(HalfEdgeMesh::next(h));
  return {BaseStep::Kind::known_vertex, h == kNone ? kNone : told_[h], true};
}

inline void PlanWriter::told_component(std::uint32_t component, std::uint32_t first_vertex, std::uint32_t /*face*/) {
  if (to_decoder_.empty()) {
    to_decoder_.assign(descent_.base.vertex_count(), kNone);
    told_.assign(4 * std::size_t{descent_.base.face_count()}, kNone);
  }
  const Seed& seed = descent_.seeds[component];
  const std::uint32_t h = descent_.base.find_halfedge(seed.s, seed.t);
  tell(h);
  const std::uint32_t third = descent_.base.apex(h);
  std::uint32_t number = first_vertex;
  for (std::uint32_t v : {seed.s, seed.t, third}) {
    to_decoder_[v] = number++;
    variant_.to_original.push_back(descent_.base_vertices[v]);
  }
}

inline void PlanWriter::told_face(std::uint32_t beyond, std::uint32_t /*face*/, std::uint32_t vertex) {
  const std::uint32_t across = descent_.base.opposite(planned(beyond));
  tell(across);
  if (vertex < variant_.to_original.size()) return;
  to_decoder_[descent_.base.apex(across)] = vertex;
  variant_.to_original.push_back(descent_.base_vertices[descent_.base.apex(across)]);
}

inline void PlanWriter::told_part(PacketPart part) {
  const double now = encoder_.bits_written();
  const double spent = now - counted_bits_;
  counted_bits_ = now;
  switch (part) {
    case PacketPart::base:
      variant_.bits.base += spent;
      break;
    case PacketPart::connectivity:
      variant_.bits.connectivity += spent;
      break;
    case PacketPart::geometry:
      variant_.bits.geometry += spent;
      break;
    case PacketPart::precision:
      variant_.bits.precision += spent;
      break;
    case PacketPart::isolated:
      variant_.bits.isolated += spent;
      break;
    case PacketPart::exactness:
      variant_.bits.exactness += spent;
      break;
  }
}

}  // namespace pmcd::codec
