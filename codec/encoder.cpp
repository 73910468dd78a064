// SPDX-License-Identifier: MIT
#include "codec/encoder.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "codec/base/base_mesh.h"
#include "codec/encoder/decimation.h"
#include "codec/encoder/exactness_search.h"
#include "codec/encoder/grouping.h"
#include "codec/encoder/plan_writer.h"
#include "codec/encoder/precision.h"
#include "codec/encoder/proof.h"
#include "codec/encoder/reflection_search.h"
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

// The lattice under a lossless mesh. Its total hardly depends on it (12 to 20 bits: within 0.2 % on nine scans), so it
// is as coarse as keeps the levels true to the eye; what is below is left to exactness.
constexpr unsigned kLosslessBits = 14;
constexpr unsigned kMostPackets = 1000;

// Where topology leaves a base mesh of more vertices than this, small packets that bend it back cannot pay: then the
// whole mesh as one base packet is tried too, up to a size that need not come in parts, and taken if it is much
// smaller.
constexpr std::uint32_t kFatBase = 100;
constexpr std::uint32_t kMostInOnePacket = 65536;
constexpr double kMuchSmaller = 0.8;

// Shares of the whole time, for progress.
constexpr double kPlanned = 0.05;
constexpr double kDecimated = 0.4;
constexpr double kWritten = 0.7;

Status check_options(const EncodeOptions& options) {
  if (options.bits && (*options.bits < kMinLatticeBits || *options.bits > kMaxLatticeBits)) {
    return Error{ErrorCode::invalid_option, *options.bits, "bits must lie in 4 to 24"};
  }
  if (options.max_packets_after_base &&
      (*options.max_packets_after_base < 1 || *options.max_packets_after_base > kMostPackets)) {
    return Error{ErrorCode::invalid_option, *options.max_packets_after_base, "levels must lie in 1 to 1000"};
  }
  if (!(options.min_flip_cosine >= -1 && options.min_flip_cosine <= 1)) {
    return Error{ErrorCode::invalid_option, 0, "the flip limit is a cosine, from -1 to 1"};
  }
  if (options.max_shape_error && !(*options.max_shape_error >= 0)) {
    return Error{ErrorCode::invalid_option, 0, "the shape limit must not be negative"};
  }
  return {};
}

// Isolated vertices along a Morton curve, so that steps from one to the next are short.
std::vector<std::uint32_t> sort_isolated(const HalfEdgeMesh& mesh, std::span<const LatticePoint> points) {
  std::vector<std::uint32_t> isolated;
  for (std::uint32_t v = 0; v < mesh.vertex_count(); ++v) {
    if (mesh.outgoing(v) == kNone) isolated.push_back(v);
  }
  auto before = [&](std::uint32_t a, std::uint32_t b) {
    // The axis whose highest differing bit is highest decides; no interleaving needed.
    std::size_t deciding = 0;
    std::uint32_t most = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto difference = static_cast<std::uint32_t>(points[a][axis] ^ points[b][axis]);
      if (most < difference && most < (most ^ difference)) {
        most = difference;
        deciding = axis;
      }
    }
    return points[a][deciding] != points[b][deciding] ? points[a][deciding] < points[b][deciding] : a < b;
  };
  std::sort(isolated.begin(), isolated.end(), before);
  return isolated;
}

struct Writing {
  EncodingPlan plan;
  LevelState state;
  std::vector<EncodedPacket> packets;  ///< payloads only, until write_headers
  std::vector<std::uint64_t> hashes;
  std::vector<std::uint8_t> missing_digits;
};

// Drives the decoder's own functions with a source that writes. The header comes before the payload when all stand, for
// the generation depends on all.
Status write_packet(Writing& w, std::span<const PassRecord> passes, unsigned shift, bool with_isolated,
                    bool with_exactness, const LevelBounds& bounds) {
  const bool is_base = w.packets.empty();
  std::vector<std::byte> bytes;
  if (is_base) append_base_header(bytes, w.state.lattice, w.state.lossless);
  PlanWriter writer(w.plan, passes, with_isolated, with_exactness, bytes);
  Status status = is_base ? code_base_level(w.state, writer, bounds.vertices, bounds.faces, shift)
                          : code_passes(w.state, bounds, shift, writer);
  if (status) status = code_isolated(w.state, bounds.vertices, writer);
  if (status) status = code_exactness(w.state, writer);
  if (!status) return Error{ErrorCode::internal_error, w.packets.size(), "writing a packet: " + status.error().detail};
  writer.finish();
  w.packets.push_back({std::move(bytes), w.state.mesh.vertex_count(), w.state.mesh.face_count()});
  w.hashes.push_back(mesh_hash(w.state));
  w.missing_digits.push_back(static_cast<std::uint8_t>(w.state.shift));
  return {};
}

void write_headers(Writing& w) {
  Hash64 generation;
  for (const EncodedPacket& packet : w.packets) {
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
  for (std::size_t k = 0; k < w.packets.size(); ++k) {
    PacketHeader header;
    header.last = k + 1 == w.packets.size();
    header.level = static_cast<std::uint32_t>(k);
    header.vertices = w.packets[k].vertices;
    header.faces = w.packets[k].faces;
    header.missing_digits = w.missing_digits[k];
    header.mesh_hash = w.hashes[k];
    header.generation = generation.value();
    w.packets[k].bytes = make_packet(header, w.packets[k].bytes);
  }
}

// What is known of the mesh before anything is removed: lattice points, seeds, isolated vertices, counts.
Status make_plan(const TriangleMesh& mesh, const Lattice& lattice, EncodingPlan& plan, EncodeReport& report) {
  Result<HalfEdgeMesh> built = HalfEdgeMesh::build(mesh.faces, mesh.positions.size());
  if (!built) return built.error();
  plan.original = &mesh;
  plan.points.reserve(mesh.positions.size());
  for (const Position& p : mesh.positions) plan.points.push_back(lattice.snap(p));
  plan.base = std::move(built).value();
  plan.seeds = choose_seeds(plan.base);
  plan.isolated = sort_isolated(plan.base, plan.points);
  report.components = static_cast<std::uint32_t>(plan.seeds.size());
  report.isolated_vertices = static_cast<std::uint32_t>(plan.isolated.size());
  for (std::uint32_t h = 0; h < 3 * plan.base.face_count(); ++h) {
    report.boundary_edges += plan.base.opposite(h) == kNone ? 1 : 0;
  }
  return {};
}

// How many passes each packet takes, given what is left for the base mesh.
std::vector<std::uint32_t> plan_packets(std::span<const PassRecord> passes, std::uint32_t vertices_in_faces,
                                        const EncodeOptions& options, std::optional<unsigned> most_packets) {
  std::uint32_t vertices = vertices_in_faces;
  for (const PassRecord& pass : passes) vertices -= static_cast<std::uint32_t>(pass.removed.size());
  const std::uint32_t base_vertices = vertices;
  std::vector<std::uint32_t> vertices_after;
  for (const PassRecord& pass : passes) {
    vertices += static_cast<std::uint32_t>(pass.removed.size());
    vertices_after.push_back(vertices);
  }
  Growth growth;
  if (options.effort == Effort::best) {  // four or five passes in the last packet
    growth.last = 4;
    growth.last_most = 5.8;
  }
  return group_passes(base_vertices, vertices_after, most_packets, growth);
}

// How many digits of positions each level leaves out: none the last, never more than the level before, and no packet
// adds more of them than it may.
std::vector<unsigned> plan_shifts(std::span<const PassRecord> passes, std::span<const std::uint32_t> groups,
                                  std::uint32_t vertices_in_faces, const PrecisionPlan& precision, unsigned bits,
                                  bool reflects) {
  std::uint32_t vertices = vertices_in_faces;
  std::vector<unsigned> shifts(groups.size() + 1, 0);
  if (reflects) return shifts;  // rounding would part vertices from their images
  std::size_t pass = passes.size();
  for (std::size_t level = groups.size(); level > 0; --level) {
    for (std::uint32_t i = 0; i < groups[level - 1]; ++i) {
      vertices -= static_cast<std::uint32_t>(passes[--pass].removed.size());
    }
    const unsigned most = shifts[level] + CoordinateModel::kMostDigits;
    shifts[level - 1] = std::min(precision.shift_at(vertices, bits), most);
  }
  for (std::size_t level = 1; level < shifts.size(); ++level)
    shifts[level] = std::min(shifts[level], shifts[level - 1]);
  return shifts;
}

// The way down and up again; without `levels` the base packet is the whole mesh.
Result<Encoded> encode_as(const TriangleMesh& mesh, const EncodeOptions& options, const Progress& progress,
                          bool levels) {
  const Error cancelled{ErrorCode::cancelled, 0, "encoding was cancelled"};
  auto go_on = [&](double fraction) { return !progress || progress(fraction); };
  Status valid = check_options(options);
  if (!valid) return valid.error();
  const bool lossless = !options.bits.has_value();
  Result<Lattice> lattice = Lattice::over(mesh, options.bits.value_or(kLosslessBits));
  if (!lattice) return lattice.error();
  Writing w;
  if (lossless) {
    LosslessPlan plan = plan_lossless(mesh, *lattice);
    *lattice = plan.lattice;
    w.plan.form = plan.form;
  }
  Encoded result;
  Status planned = make_plan(mesh, *lattice, w.plan, result.report);
  if (!planned) return planned.error();
  if (!go_on(kPlanned)) return cancelled;

  const auto total = static_cast<std::uint32_t>(mesh.positions.size());
  const std::uint32_t in_faces = total - result.report.isolated_vertices;
  bool stopped = false;
  std::vector<PassRecord> passes;
  if (levels) {
    passes = decimate(
        w.plan.base, w.plan.points, w.plan.seeds,
        {{options.min_flip_cosine, options.max_shape_error}, options.cleaning},
        [&](std::uint32_t left) {
          return go_on(kPlanned + (kDecimated - kPlanned) * (in_faces - left) / std::max(1u, in_faces));
        },
        stopped);
  }
  if (stopped) return cancelled;
  std::reverse(passes.begin(), passes.end());  // from here on coarse to fine
  result.report.passes = static_cast<std::uint32_t>(passes.size());
  for (const PassRecord& pass : passes) result.report.gates += pass.symbols.size();

  // Exactness is a packet of its own, unless only one may follow the base.
  std::optional<unsigned> most = options.max_packets_after_base;
  const bool exact = lossless && !lattice->exact && total > 0;
  const bool exact_apart = exact && (passes.empty() || !most || *most > 1);
  if (most && exact_apart && *most > 1) --*most;
  const std::vector<std::uint32_t> groups = plan_packets(passes, in_faces, options, most);

  w.state.lattice = *lattice;
  w.state.lossless = lossless;
  const LevelBounds bounds{total, static_cast<std::uint32_t>(mesh.faces.size())};
  const Alignment alignment = alignment_of(mesh, w.plan.points);
  const PrecisionPlan precision(mesh, w.plan.points, alignment);
  w.plan.guessing = options.effort == Effort::best ? Guessing::often : Guessing::once;
  w.plan.structured = alignment != Alignment::none;
  w.plan.reflection = find_reflection(w.plan.points, lattice->max_index(), lattice->snap(Position{}));
  const std::vector<unsigned> shifts =
      plan_shifts(passes, groups, in_faces, precision, lattice->bits, w.plan.reflection.any());
  Status written = write_packet(w, {}, shifts[0], groups.empty(), false, bounds);
  w.plan.base = HalfEdgeMesh();
  w.state.mesh.reserve(total, bounds.faces);
  w.state.points.reserve(total);
  w.plan.to_original.reserve(total);
  std::size_t first_pass = 0;
  for (std::size_t k = 0; k < groups.size() && written; ++k) {
    const bool last = k + 1 == groups.size();
    const std::span<PassRecord> of_packet(passes.data() + first_pass, groups[k]);
    written = write_packet(w, of_packet, shifts[k + 1], last, last && exact && !exact_apart, bounds);
    for (PassRecord& pass : of_packet) pass = {};
    first_pass += groups[k];
    if (!go_on(kDecimated + (kWritten - kDecimated) * w.state.mesh.vertex_count() / std::max(1u, total))) {
      return cancelled;
    }
  }
  if (written && exact_apart) written = write_packet(w, {}, 0, false, true, bounds);
  if (!written) return written.error();
  write_headers(w);
  w.state = {};
  if (!go_on(kWritten)) return cancelled;

  Status proof = prove(w.packets, mesh, *lattice, lossless, w.plan.to_original);
  if (!proof) return proof.error();
  if (!go_on(1)) return cancelled;
  result.report.bits = w.plan.bits;
  result.packets = std::move(w.packets);
  return result;
}

std::size_t total_bytes(const Encoded& encoded) {
  std::size_t sum = 0;
  for (const EncodedPacket& packet : encoded.packets) sum += packet.bytes.size();
  return sum;
}

}  // namespace

Result<Encoded> encode(const TriangleMesh& mesh, const EncodeOptions& options, const Progress& progress) {
  Result<Encoded> in_levels = encode_as(mesh, options, progress, true);
  if (in_levels && options.effort == Effort::best) {
    // What is meant to be smaller is not always: small meshes have too few vertices for a large last packet.
    EncodeOptions plain = options;
    plain.effort = Effort::standard;
    Result<Encoded> other = encode_as(
        mesh, plain, [&](double) { return !progress || progress(1); }, true);
    if (!other) return other;
    if (total_bytes(*other) < total_bytes(*in_levels)) in_levels = std::move(other);
  }
  if (!in_levels || in_levels->report.passes == 0 || in_levels->packets[0].vertices <= kFatBase ||
      mesh.positions.size() > kMostInOnePacket) {
    return in_levels;
  }
  Result<Encoded> in_one = encode_as(
      mesh, options, [&](double) { return !progress || progress(1); }, false);
  if (!in_one) return in_one;
  const auto much_smaller = kMuchSmaller * static_cast<double>(total_bytes(*in_levels));
  return static_cast<double>(total_bytes(*in_one)) < much_smaller ? std::move(in_one) : std::move(in_levels);
}

}  // namespace pmcd::codec
