// SPDX-License-Identifier: GPL-3.0-or-later
// Reads a PLY header line by line. Lines may end in LF or CRLF; the byte behind end_header's line end starts the data.
#include "codec/import/ply_header.h"

#include <array>
#include <optional>
#include <utility>

#include "codec/import/raw_mesh.h"

namespace pmcd::import {
namespace {

std::optional<PlyType> type_named(std::string_view name) {
  static constexpr std::array<std::pair<std::string_view, PlyType>, 16> kNames{{
      {"char", PlyType::int8},
      {"uchar", PlyType::uint8},
      {"short", PlyType::int16},
      {"ushort", PlyType::uint16},
      {"int", PlyType::int32},
      {"uint", PlyType::uint32},
      {"float", PlyType::float32},
      {"double", PlyType::float64},
      {"int8", PlyType::int8},
      {"uint8", PlyType::uint8},
      {"int16", PlyType::int16},
      {"uint16", PlyType::uint16},
      {"int32", PlyType::int32},
      {"uint32", PlyType::uint32},
      {"float32", PlyType::float32},
      {"float64", PlyType::float64},
  }};
  for (const auto& [known, type] : kNames) {
    if (known == name) return type;
  }
  return std::nullopt;
}

class HeaderParser {
 public:
  explicit HeaderParser(std::span<const std::byte> bytes) : bytes_(bytes), text_(as_text(bytes)) {}

  ImportResult<PlyHeader> parse() {
    if (!next_line() || line_ != "ply") {
      return here(ImportErrorCode::wrong_format, "a PLY file starts with the line 'ply'; this one does not");
    }
    bool has_format = false;
    while (next_line()) {
      Tokens tokens(line_);
      const std::string_view keyword = tokens.next();
      ImportFailure failure;
      if (keyword == "end_header") {
        if (!has_format) return here(ImportErrorCode::malformed, "the header has no 'format' line; add it");
        header_.size = next_;
        return std::move(header_);
      }
      if (keyword == "format") {
        failure = format(tokens);
        has_format = true;
      } else if (keyword == "element") {
        failure = element(tokens);
      } else if (keyword == "property") {
        failure = property(tokens);
      } else if (!keyword.empty() && keyword != "comment" && keyword != "obj_info") {
        failure = here(ImportErrorCode::malformed, "a PLY header has no " + shown(keyword) + " lines; correct it");
      }
      if (failure) return std::move(*failure);
    }
    place_ = bytes_.size();
    return here(ImportErrorCode::truncated, "the header has no 'end_header' line; fetch or export the file again");
  }

 private:
  bool next_line() {
    if (next_ >= text_.size()) return false;
    place_ = next_;
    const std::size_t end = text_.find('\n', next_);
    // A binary file without end_header must not be searched as one endless line of names.
    if (end == std::string_view::npos) return false;
    line_ = text_.substr(next_, end - next_);
    if (line_.ends_with('\r')) line_.remove_suffix(1);
    next_ = end + 1;
    return true;
  }

  [[nodiscard]] ImportError here(ImportErrorCode code, std::string message) const {
    return error_at(code, bytes_, place_, true, std::move(message));
  }

  ImportFailure format(Tokens& tokens) {
    const std::string_view name = tokens.next();
    const std::string_view version = tokens.next();
    if (name == "ascii") {
      header_.encoding = PlyEncoding::ascii;
    } else if (name == "binary_little_endian") {
      header_.encoding = PlyEncoding::binary_little_endian;
    } else if (name == "binary_big_endian") {
      header_.encoding = PlyEncoding::binary_big_endian;
    } else {
      return here(ImportErrorCode::unsupported_variant,
                  "format " + shown(name) + " is none of ascii, binary_little_endian, binary_big_endian");
    }
    if (version != "1.0") {
      return here(ImportErrorCode::unsupported_variant, "PLY version " + shown(version) + " is not read, only 1.0");
    }
    return {};
  }

  ImportFailure element(Tokens& tokens) {
    PlyElement added;
    added.name = tokens.next();
    const std::string_view count = tokens.next();
    const std::optional<std::int64_t> parsed = parse_integer(count);
    if (added.name.empty() || !parsed || *parsed < 0) {
      return here(ImportErrorCode::malformed, "expected 'element NAME COUNT', the count is " + shown(count));
    }
    added.count = static_cast<std::uint64_t>(*parsed);
    for (const PlyElement& known : header_.elements) {
      if (known.name == added.name && (added.name == "vertex" || added.name == "face")) {
        return here(ImportErrorCode::malformed, "element " + shown(added.name) + " is declared twice");
      }
    }
    header_.elements.push_back(std::move(added));
    return {};
  }

  ImportFailure property(Tokens& tokens) {
    if (header_.elements.empty()) {
      return here(ImportErrorCode::malformed, "a property stands before the first element; correct the header");
    }
    PlyProperty added;
    std::string_view type = tokens.next();
    if (type == "list") {
      added.is_list = true;
      const std::string_view count = tokens.next();
      const std::optional<PlyType> count_type = type_named(count);
      if (!count_type) return unknown_type(count);
      added.count_type = *count_type;
      type = tokens.next();
    }
    const std::optional<PlyType> value_type = type_named(type);
    if (!value_type) return unknown_type(type);
    added.type = *value_type;
    added.name = tokens.next();
    if (added.name.empty()) return here(ImportErrorCode::malformed, "a property without a name; correct the header");
    header_.elements.back().properties.push_back(std::move(added));
    return {};
  }

  [[nodiscard]] ImportError unknown_type(std::string_view name) const {
    return here(ImportErrorCode::malformed, shown(name) +
                                                " is no PLY type (char, uchar, short, ushort, int, uint, "
                                                "float, double or int8 ... float64)");
  }

  std::span<const std::byte> bytes_;
  std::string_view text_;
  std::size_t next_ = 0;
  std::size_t place_ = 0;
  std::string_view line_;
  PlyHeader header_;
};

}  // namespace

std::size_t ply_type_bytes(PlyType type) {
  switch (type) {
    case PlyType::int8:
    case PlyType::uint8:
      return 1;
    case PlyType::int16:
    case PlyType::uint16:
      return 2;
    case PlyType::int32:
    case PlyType::uint32:
    case PlyType::float32:
      return 4;
    case PlyType::float64:
      return 8;
  }
  return 1;
}

ImportResult<PlyHeader> parse_ply_header(std::span<const std::byte> bytes) {
  return HeaderParser(bytes).parse();
}

}  // namespace pmcd::import
