// SPDX-License-Identifier: MIT
#include "codec/encoder/variant.h"

#include <algorithm>
#include <span>
#include <utility>

#include "codec/base/base_mesh.h"
#include "codec/encoder/grouping.h"
#include "codec/encoder/plan_writer.h"
#include "codec/exactness.h"
#include "codec/geometry/coordinate_model.h"
#include "codec/level_state.h"
#include "codec/packet/base_header.h"
#include "codec/packet/hash.h"
#include "codec/packet/header.h"
#include "codec/refine.h"
#include "codec/tail.h"

namespace pmcd::codec {
namespace {

struct Writing {
  const EncodingPlan& plan;
  const Descent& descent;
  Spending spending;
  LevelState state;
  Variant variant;  ///< its packets are payloads only, until write_headers
  std::vector<std::uint64_t> hashes;
  std::vector<std::uint8_t> missing_digits;
};

// Drives the decoder's own functions with a source that writes. The header comes before the payload when all stand, for
// the generation depends on all.
Status write_packet(Writing& w, std::span<const PassRecord> passes, unsigned shift, bool with_isolated,
                    bool with_exactness) {
  std::vector<EncodedPacket>& packets = w.variant.packets;
  const bool is_base = packets.empty();
  const LevelBounds bounds{static_cast<std::uint32_t>(w.plan.points.size()),
                           static_cast<std::uint32_t>(w.plan.original->faces.size())};
  std::vector<std::byte> bytes;
  if (is_base) append_base_header(bytes, w.state.lattice, w.state.lossless);
  PlanWriter writer(w.plan, w.descent, {passes, w.spending, with_isolated, with_exactness}, w.variant, bytes);
  Status status = is_base ? code_base_level(w.state, writer, bounds.vertices, bounds.faces, shift)
                          : code_passes(w.state, bounds, shift, writer);
  if (status) status = code_isolated(w.state, bounds.vertices, writer);
  if (status) status = code_exactness(w.state, writer);
  if (!status) return Error{ErrorCode::internal_error, packets.size(), "writing a packet: " + status.error().detail};
  writer.finish();
  packets.push_back({std::move(bytes), w.state.mesh.vertex_count(), w.state.mesh.face_count()});
  w.hashes.push_back(mesh_hash(w.state));
  w.missing_digits.push_back(static_cast<std::uint8_t>(w.state.shift));
  return {};
}

void write_headers(Writing& w) {
  std::vector<EncodedPacket>& packets = w.variant.packets;
  Hash64 generation;
  for (const EncodedPacket& packet : packets) {
    generation.add(packet.bytes.size());
    std::uint64_t word = 0;
    for (std::size_t i = 0; i < packet.bytes.size(); ++i) {
      word = (word << 8) | static_cast<std::uint64_t>(packet.bytes[i]);
      if (i % 8 == 7 || i + 1 == packet.bytes.size()) {
        generation.add(word);
        word = 0;
      }
    }
  }
  for (std::uint64_t hash : w.hashes) generation.add(hash);
  for (std::size_t k = 0; k < packets.size(); ++k) {
    PacketHeader header;
    header.last = k + 1 == packets.size();
    header.level = static_cast<std::uint32_t>(k);
    header.vertices = packets[k].vertices;
    header.faces = packets[k].faces;
    header.missing_digits = w.missing_digits[k];
    header.mesh_hash = w.hashes[k];
    header.generation = generation.value();
    packets[k].bytes = make_packet(header, packets[k].bytes);
  }
}

// How many passes each packet takes, given what is left for the base mesh.
std::vector<std::uint32_t> plan_packets(const Descent& descent, Effort effort, std::optional<unsigned> most_packets) {
  const std::uint32_t base_vertices = descent.base.vertex_count();
  std::uint32_t vertices = base_vertices;
  std::vector<std::uint32_t> vertices_after;
  for (const PassRecord& pass : descent.passes) {
    vertices += static_cast<std::uint32_t>(pass.removed.size());
    vertices_after.push_back(vertices);
  }
  Growth growth;
  if (effort == Effort::best) {  // four or five passes in the last packet
    growth.last = 4;
    growth.last_most = 5.8;
  }
  return group_passes(base_vertices, vertices_after, most_packets, growth);
}

// How many digits of positions each level leaves out: none the last, never more than the level before, and no packet
// adds more of them than it may.
std::vector<unsigned> plan_shifts(const EncodingPlan& plan, std::span<const PassRecord> passes,
                                  std::span<const std::uint32_t> groups) {
  std::uint32_t vertices = plan.vertices_in_faces();
  std::vector<unsigned> shifts(groups.size() + 1, 0);
  if (plan.reflection.any()) return shifts;  // rounding would part vertices from their images
  std::size_t pass = passes.size();
  for (std::size_t level = groups.size(); level > 0; --level) {
    for (std::uint32_t i = 0; i < groups[level - 1]; ++i) {
      vertices -= static_cast<std::uint32_t>(passes[--pass].removed.size());
    }
    const unsigned most = shifts[level] + CoordinateModel::kMostDigits;
    shifts[level - 1] = std::min(plan.precision.shift_at(vertices, plan.lattice.bits), most);
  }
  for (std::size_t level = 1; level < shifts.size(); ++level)
    shifts[level] = std::min(shifts[level], shifts[level - 1]);
  return shifts;
}

}  // namespace

Result<Variant> write_variant(const EncodingPlan& plan, Descent& descent, Passes then, const VariantOptions& options,
                              const WritingProgress& progress) {
  const std::span<PassRecord> passes = descent.passes;
  std::optional<unsigned> most_packets = options.most_packets;
  // Exactness is a packet of its own, unless only one may follow the base.
  const bool exact = plan.has_exactness();
  const bool exact_apart = exact && (passes.empty() || !most_packets || *most_packets > 1);
  if (most_packets && exact_apart && *most_packets > 1) --*most_packets;
  const std::vector<std::uint32_t> groups = plan_packets(descent, options.effort, most_packets);
  const std::vector<unsigned> shifts = plan_shifts(plan, passes, groups);

  Writing w{plan, descent, options.spending, {}, {}, {}, {}};
  w.state.lattice = plan.lattice;
  w.state.lossless = plan.lossless;
  const auto total = static_cast<std::uint32_t>(plan.points.size());
  Status written = write_packet(w, {}, shifts[0], groups.empty(), false);
  w.state.mesh.reserve(total, static_cast<std::uint32_t>(plan.original->faces.size()));
  w.state.points.reserve(total);
  w.variant.to_original.reserve(total);
  std::size_t first_pass = 0;
  for (std::size_t k = 0; k < groups.size() && written; ++k) {
    const bool last = k + 1 == groups.size();
    const std::span<PassRecord> of_packet = passes.subspan(first_pass, groups[k]);
    written = write_packet(w, of_packet, shifts[k + 1], last, last && exact && !exact_apart);
    first_pass += groups[k];
    if (then == Passes::use_up) {
      for (PassRecord& pass : of_packet) pass = {};
    }
    if (!progress(static_cast<double>(w.state.mesh.vertex_count()) / std::max(1u, total))) {
      return Error{ErrorCode::cancelled, 0, "encoding was cancelled"};
    }
  }
  if (written && exact_apart) written = write_packet(w, {}, 0, false, true);
  if (!written) return written.error();
  write_headers(w);
  return std::move(w.variant);
}

}  // namespace pmcd::codec
