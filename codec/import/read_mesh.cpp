// SPDX-License-Identifier: GPL-3.0-or-later
// Chooses the reader and says, when a file is not what its name claims, what it looks like instead.
#include "codec/import/read_mesh.h"

#include <algorithm>
#include <array>

#include "codec/import/file_io.h"
#include "codec/import/text.h"

namespace pmcd::import {
namespace {

using Reader = ImportResult<RawMesh> (*)(std::span<const std::byte>, const ReadOptions&);

struct Format {
  const char* extension;
  Reader read;
};

constexpr std::array<Format, 4> kFormats{{{"ply", read_ply}, {"obj", read_obj}, {"off", read_off}, {"stl", read_stl}}};

bool starts_with_bytes(std::span<const std::byte> bytes, std::string_view magic) {
  return as_text(bytes).starts_with(magic);
}

const char* packer_of(std::span<const std::byte> bytes) {
  if (starts_with_bytes(bytes, "\x1f\x8b")) return "gzip";
  if (starts_with_bytes(bytes, "PK\x03\x04")) return "zip";
  if (starts_with_bytes(bytes,
                        "\xfd"
                        "7zXZ"))
    return "xz";
  if (starts_with_bytes(bytes, "BZh")) return "bzip2";
  if (starts_with_bytes(bytes, "\x28\xb5\x2f\xfd")) return "zstd";
  return nullptr;
}

/// The format that the first bytes speak for; empty if they do not tell.
std::string_view look_of(std::span<const std::byte> bytes) {
  Lines lines(as_text(bytes.first(std::min<std::size_t>(bytes.size(), 4096))), 0,
              {.hash_comments = true, .backslash_continues = false});
  if (!lines.next()) return {};
  const std::string_view first = Tokens(lines.line()).next();
  if (first == "ply") return "PLY";
  if (first.ends_with("OFF") && first.size() <= 8) return "OFF";
  if (equal_ignoring_case(first, "solid")) return "STL";
  if (first == "v" || first == "vn" || first == "vt" || first == "mtllib" || first == "o") return "OBJ";
  if (first.starts_with("PMCD")) return "pmcd";
  return {};
}

}  // namespace

ImportResult<ImportedMesh> read_mesh(std::span<const std::byte> bytes, const std::string& extension,
                                     const ImportOptions& options) {
  const auto refuse = [](ImportErrorCode code, std::string message) {
    ImportError error;
    error.code = code;
    error.message = std::move(message);
    return error;
  };
  if (bytes.empty()) {
    return refuse(ImportErrorCode::empty_file, "the file is empty; fetch or export it again");
  }
  if (const char* packer = packer_of(bytes)) {
    return refuse(ImportErrorCode::compressed, std::string("is compressed with ") + packer + "; unpack it first");
  }
  const auto format =
      std::find_if(kFormats.begin(), kFormats.end(), [&](const Format& f) { return extension == f.extension; });
  if (format == kFormats.end()) {
    return refuse(ImportErrorCode::unknown_extension,
                  "the extension " + shown(extension) + " names no mesh format; pmcd reads .ply, .obj, .off and .stl");
  }
  ImportResult<RawMesh> raw = format->read(bytes, ReadOptions{options.as_double});
  if (!raw) {
    ImportError error = std::move(raw.error());
    const std::string_view look = look_of(bytes);
    const bool other = !look.empty() && !equal_ignoring_case(look, extension);
    const bool doubts = error.code == ImportErrorCode::wrong_format || error.code == ImportErrorCode::malformed ||
                        error.code == ImportErrorCode::truncated;
    if (other && doubts) {
      error.code = ImportErrorCode::wrong_format;
      error.message += "; it looks like a " + std::string(look) + " file, give it that extension";
    }
    return error;
  }
  return prepare(std::move(raw).value(), bytes, options);
}

ImportResult<ImportedMesh> read_mesh(const std::string& path, const ImportOptions& options) {
  const ImportResult<std::vector<std::byte>> bytes = load_file(path);
  if (!bytes) return bytes.error();
  ImportResult<ImportedMesh> mesh = read_mesh(*bytes, extension_of(path), options);
  if (!mesh) mesh.error().file = path;
  return mesh;
}

}  // namespace pmcd::import
