// SPDX-License-Identifier: GPL-3.0-or-later
// From a mesh file to everything that a .pmcd file or a database needs: packets that are proven, and a directory with
// the error of each level. Reads the file, writes none.
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

/// One of the last two comes after encoding.
enum class IngestStage : std::uint8_t {
  reading,
  encoding,
  proving,   ///< all packets are decoded and the last level is compared
  measuring  ///< the same, and each level's error is measured on the way
};

/// The stage in one word, as its enumerator. Never null.
const char* stage_name(IngestStage stage);

/// Told the stage and how far it is, from 0 to 1; neither ever falls. Answers whether to go on.
using IngestProgress = std::function<bool(IngestStage stage, double fraction)>;

struct IngestOptions {
  ImportOptions import;
  codec::EncodeOptions encode;
  bool measure_errors = true;  ///< each level's error, into the directory
  IngestProgress progress;
};

/// Packets that prove() has seen.
struct Ingested {
  ImportReport import_report;
  codec::EncodeReport encode_report;
  codec::Directory directory;  ///< errors filled in if they were measured
  std::vector<codec::EncodedPacket> packets;
  double read_seconds = 0;
  double encode_seconds = 0;   ///< planning and writing, with the directory; no decoding
  double prove_seconds = 0;    ///< decoding all packets and comparing the last level
  double measure_seconds = 0;  ///< the distances of all levels; 0 if nothing was measured
};

/// Reads, encodes and proves `path`. Errors: those of read_mesh; invalid_option; cancelled; encoder_refused, also when
/// the proof fails.
ImportResult<Ingested> ingest_file(const std::string& path, const IngestOptions& options);

/// The same for a mesh that is in memory already; `file` stands in errors only.
ImportResult<Ingested> ingest_mesh(ImportedMesh imported, const std::string& file, const IngestOptions& options);

/// The second half of ingest_mesh: proves `encoded` and measures on the levels that the proof decodes. Nothing but an
/// error comes out if it is no encoding of `mesh`. The import report stays empty. REQUIRES: encode() takes `mesh`.
ImportResult<Ingested> ingest_encoded(codec::Encoded encoded, const codec::TriangleMesh& mesh, const std::string& file,
                                      const IngestOptions& options);

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
