// SPDX-License-Identifier: MIT
#include "codec/encoder.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "codec/encoder/encoding_plan.h"
#include "codec/encoder/variant.h"

namespace pmcd::codec {
namespace {

constexpr unsigned kMostPackets = 1000;

// Where topology leaves a base mesh of more vertices than this, small packets that bend it back cannot pay: then the
// whole mesh as one base packet is tried too, up to a size that need not come in parts, and taken if it is much
// smaller.
constexpr std::uint32_t kFatBase = 100;
constexpr std::uint32_t kMostInOnePacket = 65536;
constexpr double kMuchSmaller = 0.8;

// Shares of the whole time, for progress.
constexpr double kPlanned = 0.07;
constexpr double kDecimated = 0.57;
constexpr double kWritten = 0.97;  // the packet that lifts to the original coordinates comes after it

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

Error cancelled() {
  return {ErrorCode::cancelled, 0, "encoding was cancelled"};
}

EncodeReport report_of(const EncodingPlan& plan, const Descent& descent) {
  EncodeReport report;
  report.components = static_cast<std::uint32_t>(descent.seeds.size());
  report.isolated_vertices = static_cast<std::uint32_t>(plan.isolated.size());
  report.boundary_edges = plan.boundary_edges;
  report.passes = static_cast<std::uint32_t>(descent.passes.size());
  for (const PassRecord& pass : descent.passes) report.gates += pass.symbols.size();
  return report;
}

Encoded encoded_of(Variant variant, const EncodingPlan& plan, EncodeReport report) {
  report.bits = variant.bits;
  return {std::move(variant.packets), report, {plan.lossless, plan.lattice, std::move(variant.to_original)}};
}

// All variants that may be the smallest; the one that is.
Result<Encoded> write_smallest(const TriangleMesh& mesh, const EncodeOptions& options, const Progress& go_on) {
  HalfEdgeMesh halfedges;
  const Result<EncodingPlan> plan = make_plan(mesh, options.bits, halfedges);
  if (!plan) return plan.error();
  if (!go_on(kPlanned)) return cancelled();
  const std::uint32_t in_faces = std::max(1u, plan->vertices_in_faces());
  std::optional<Descent> descent = descend(
      std::move(halfedges), *plan, {{options.min_flip_cosine, options.max_shape_error}, options.cleaning},
      [&](std::uint32_t left) { return go_on(kPlanned + (kDecimated - kPlanned) * (in_faces - left) / in_faces); });
  if (!descent) return cancelled();

  // What is meant to be smaller is not always: small meshes have too few vertices for a large last packet. So best
  // effort writes the standard stream too.
  std::vector<Effort> efforts{options.effort};
  if (options.effort == Effort::best) efforts.push_back(Effort::standard);
  auto variant_options = [&](Effort effort) {
    return VariantOptions{effort, plan_spending(effort, plan->alignment, plan->points.size()),
                          options.max_packets_after_base};
  };
  Variant best;
  EncodeReport report = report_of(*plan, *descent);
  for (std::size_t i = 0; i < efforts.size(); ++i) {
    auto told = [&](double share) {
      const double written = (static_cast<double>(i) + share) / static_cast<double>(efforts.size());
      return go_on(kDecimated + (kWritten - kDecimated) * written);
    };
    const Passes then = i + 1 < efforts.size() ? Passes::keep : Passes::use_up;
    Result<Variant> variant = write_variant(*plan, *descent, then, variant_options(efforts[i]), told);
    if (!variant) return variant.error();
    if (i == 0 || variant->total_bytes() < best.total_bytes()) best = std::move(variant).value();
  }
  if (descent->passes.empty() || descent->base.vertex_count() <= kFatBase || mesh.positions.size() > kMostInOnePacket) {
    return encoded_of(std::move(best), *plan, report);
  }
  const Result<HalfEdgeMesh> again = HalfEdgeMesh::build(mesh.faces, mesh.positions.size());
  if (!again) return again.error();
  Descent none = stay(*again);
  Result<Variant> in_one = write_variant(*plan, none, Passes::use_up, variant_options(options.effort),
                                         [&](double) { return go_on(kWritten); });
  if (!in_one) return in_one.error();
  const auto much_smaller = kMuchSmaller * static_cast<double>(best.total_bytes());
  if (static_cast<double>(in_one->total_bytes()) < much_smaller) {
    best = std::move(in_one).value();
    report = report_of(*plan, none);
  }
  return encoded_of(std::move(best), *plan, report);
}

}  // namespace

Result<Encoded> encode(const TriangleMesh& mesh, const EncodeOptions& options, const Progress& progress) {
  auto go_on = [&](double fraction) { return !progress || progress(fraction); };
  Status valid = check_options(options);
  if (!valid) return valid.error();
  Result<Encoded> encoded = write_smallest(mesh, options, go_on);
  if (encoded && !go_on(1)) return cancelled();
  return encoded;
}

}  // namespace pmcd::codec
