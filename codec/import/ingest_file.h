// SPDX-License-Identifier: GPL-3.0-or-later
// From a mesh file to everything that a .pmcd file or a database needs: packets, and a directory with the error of each
// level. Reads the file, writes none.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "codec/decoder.h"
#include "codec/encoder.h"
#include "codec/import/error.h"
#include "codec/import/read_mesh.h"
#include "codec/packet/directory.h"

namespace pmcd::import {

enum class IngestStage : std::uint8_t { reading, encoding, measuring };

/// Told the stage and how far it is, from 0 to 1; answers whether to go on.
using IngestProgress = std::function<bool(IngestStage stage, double fraction)>;

struct IngestOptions {
  ImportOptions import;
  codec::EncodeOptions encode;
  bool measure_errors = true;  ///< decode level by level and write each level's error into the directory
  IngestProgress progress;
};

struct Ingested {
  ImportReport import_report;
  codec::EncodeReport encode_report;
  codec::Directory directory;  ///< errors filled in if they were measured
  std::vector<codec::EncodedPacket> packets;
  double read_seconds = 0;
  double encode_seconds = 0;
  double measure_seconds = 0;  ///< 0 if nothing was measured
};

/// Reads and encodes `path`. Errors: those of read_mesh; invalid_option; cancelled; encoder_refused.
ImportResult<Ingested> ingest_file(const std::string& path, const IngestOptions& options);

/// The same for a mesh that is in memory already; `file` stands in errors only.
ImportResult<Ingested> ingest_mesh(ImportedMesh imported, const std::string& file, const IngestOptions& options);

/// The bytes of a .pmcd file.
std::vector<std::byte> to_file_bytes(const Ingested& ingested);

/// An error of the codec about file `file`, as an ImportError with what the codec said. `code` is used unless the codec
/// names an option or a cancellation.
ImportError from_codec(const codec::Error& error, ImportErrorCode code, const std::string& file);

/// Decodes the packets of a .pmcd file in memory up to level `last`, the last of all if none is named. `file` stands in
/// errors only. Errors: bad_packet_file; invalid_option if the file has no such level.
ImportResult<codec::TriangleMesh> decode_file_bytes(std::span<const std::byte> bytes, std::optional<std::uint32_t> last,
                                                    const std::string& file);

}  // namespace pmcd::import
