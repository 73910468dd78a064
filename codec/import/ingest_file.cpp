// SPDX-License-Identifier: GPL-3.0-or-later
// Import, encode, then one decoding that proves the packets and measures the levels. Each part's time is told apart.
#include "codec/import/ingest_file.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <span>

#include "codec/import/measure.h"
#include "codec/proof.h"

namespace pmcd::import {
namespace {

class Stopwatch {
 public:
  [[nodiscard]] double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

ImportError cancelled(const std::string& file) {
  ImportError error;
  error.code = ImportErrorCode::cancelled;
  error.file = file;
  error.message = "cancelled; nothing was written";
  return error;
}

void fill_box(const codec::TriangleMesh& mesh, codec::Directory& directory) {
  if (mesh.positions.empty()) return;
  directory.box_min = directory.box_max = mesh.positions.front();
  for (const codec::Position& p : mesh.positions) {
    for (std::size_t k = 0; k < 3; ++k) {
      directory.box_min[k] = std::min(directory.box_min[k], p[k]);
      directory.box_max[k] = std::max(directory.box_max[k], p[k]);
    }
  }
}

codec::Result<codec::Directory> directory_of(const std::vector<codec::EncodedPacket>& packets) {
  std::vector<std::span<const std::byte>> views(packets.size());
  std::transform(packets.begin(), packets.end(), views.begin(),
                 [](const codec::EncodedPacket& p) { return std::span<const std::byte>(p.bytes); });
  return codec::make_directory(views);
}

/// An error that is beyond double stays "not measured".
void measure_level(const ErrorMeter& meter, const codec::Decoder& decoder, codec::LevelEntry& entry) {
  const Distance distance = meter.distance_to(decoder.mesh());
  if (!std::isfinite(distance.rms) || !std::isfinite(distance.max)) return;
  entry.error_rms = distance.rms;
  entry.error_max = distance.max;
}

/// Proves `encoded` and writes each level's error into `out`, if that is asked for; and both times.
codec::Status prove_and_measure(const codec::Encoded& encoded, const codec::TriangleMesh& mesh,
                                const IngestOptions& options, Ingested& out) {
  const Stopwatch both;
  const IngestStage stage = options.measure_errors ? IngestStage::measuring : IngestStage::proving;
  auto go_on = [&](double fraction) { return !options.progress || options.progress(stage, fraction); };
  std::optional<ErrorMeter> meter;
  auto timed = [&](auto measure) {
    const Stopwatch measuring;
    measure();
    out.measure_seconds += measuring.seconds();
  };
  if (options.measure_errors) timed([&] { meter.emplace(mesh); });
  codec::Status proven = codec::prove(encoded, mesh, [&](std::size_t k, const codec::Decoder& decoder) {
    if (!go_on(static_cast<double>(k) / static_cast<double>(encoded.packets.size()))) return false;
    if (meter) timed([&] { measure_level(*meter, decoder, out.directory.levels[k]); });
    return true;
  });
  out.prove_seconds = both.seconds() - out.measure_seconds;
  if (proven && !go_on(1)) return codec::Error{codec::ErrorCode::cancelled, 0, "ingesting was cancelled"};
  return proven;
}

}  // namespace

ImportError from_codec(const codec::Error& error, ImportErrorCode code, const std::string& file) {
  using codec::ErrorCode;
  if (error.code == ErrorCode::cancelled) return cancelled(file);
  ImportError out;
  out.code = error.code == ErrorCode::invalid_option ? ImportErrorCode::invalid_option : code;
  out.file = file;
  out.message = error.detail + " (" + codec::error_name(error.code) + ")";
  if (code != ImportErrorCode::bad_packet_file) {
    out.element = error.where;
    return out;
  }
  // Other codes count from the start of a packet, and their sentence says which.
  if (error.code == ErrorCode::truncated || error.code == ErrorCode::bad_magic ||
      error.code == ErrorCode::trailing_bytes) {
    out.byte = error.where;
  }
  out.message += error.code == ErrorCode::unsupported_version || error.code == ErrorCode::unsupported_feature
                     ? "; encode the mesh again with this version of pmcd"
                     : "; fetch or encode it again";
  return out;
}

const char* stage_name(IngestStage stage) {
  switch (stage) {
    case IngestStage::reading:
      return "reading";
    case IngestStage::encoding:
      return "encoding";
    case IngestStage::proving:
      return "proving";
    case IngestStage::measuring:
      return "measuring";
  }
  return "";
}

ImportResult<Ingested> ingest_encoded(codec::Encoded encoded, const codec::TriangleMesh& mesh, const std::string& file,
                                      const IngestOptions& options) {
  Ingested out;
  const Stopwatch listing;
  codec::Result<codec::Directory> directory = directory_of(encoded.packets);
  if (!directory) return from_codec(directory.error(), ImportErrorCode::encoder_refused, file);
  out.directory = std::move(directory).value();
  fill_box(mesh, out.directory);
  out.encode_seconds = listing.seconds();
  const codec::Status proven = prove_and_measure(encoded, mesh, options, out);
  if (!proven) return from_codec(proven.error(), ImportErrorCode::encoder_refused, file);
  out.packets = std::move(encoded.packets);
  out.encode_report = encoded.report;
  return out;
}

ImportResult<Ingested> ingest_mesh(ImportedMesh imported, const std::string& file, const IngestOptions& options) {
  const Stopwatch encoding;
  codec::Progress progress;
  if (options.progress) {
    progress = [&](double fraction) { return options.progress(IngestStage::encoding, fraction); };
  }
  codec::Result<codec::Encoded> encoded = codec::encode(imported.mesh, options.encode, progress);
  if (!encoded) return from_codec(encoded.error(), ImportErrorCode::encoder_refused, file);
  const double encode_seconds = encoding.seconds();
  ImportResult<Ingested> out = ingest_encoded(std::move(encoded).value(), imported.mesh, file, options);
  if (!out) return out;
  out->import_report = std::move(imported.report);
  out->encode_seconds += encode_seconds;
  return out;
}

ImportResult<Ingested> ingest_file(const std::string& path, const IngestOptions& options) {
  const Stopwatch reading;
  if (options.progress && !options.progress(IngestStage::reading, 0)) return cancelled(path);
  ImportResult<ImportedMesh> imported = read_mesh(path, options.import);
  if (!imported) return imported.error();
  const double read_seconds = reading.seconds();
  ImportResult<Ingested> out = ingest_mesh(std::move(imported).value(), path, options);
  if (out) out->read_seconds = read_seconds;
  return out;
}

std::vector<std::byte> to_file_bytes(const Ingested& ingested) {
  std::vector<std::byte> bytes = codec::serialize(ingested.directory);
  for (const codec::EncodedPacket& packet : ingested.packets) {
    bytes.insert(bytes.end(), packet.bytes.begin(), packet.bytes.end());
  }
  return bytes;
}

ImportResult<codec::TriangleMesh> decode_file_bytes(std::span<const std::byte> bytes, std::optional<std::uint32_t> last,
                                                    const std::string& file) {
  const codec::Result<codec::ParsedFile> parsed = codec::parse_file(bytes);
  if (!parsed) return from_codec(parsed.error(), ImportErrorCode::bad_packet_file, file);
  const std::size_t levels = parsed->packets.size();
  if (last && *last >= levels) {
    ImportError error;
    error.code = ImportErrorCode::invalid_option;
    error.file = file;
    error.message = "has no level " + std::to_string(*last) + "; the last one is " + std::to_string(levels - 1);
    return error;
  }
  codec::Decoder decoder;
  for (std::size_t k = 0; k < (last ? *last + std::size_t{1} : levels); ++k) {
    const codec::Result<codec::Level> level = decoder.apply(parsed->packets[k]);
    if (!level) {
      ImportError error = from_codec(level.error(), ImportErrorCode::bad_packet_file, file);
      error.byte.reset();
      error.message.insert(0, "packet " + std::to_string(k) + ": ");
      return error;
    }
  }
  return decoder.mesh();
}

}  // namespace pmcd::import
