// SPDX-License-Identifier: GPL-3.0-or-later
// PLY: ascii and both binaries through one walk over elements and properties, driven by a source of values. Vertices
// and faces are kept; every other element and property is skipped and listed. Triangle strips are not unrolled.
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "codec/import/ply_header.h"
#include "codec/import/raw_mesh.h"

namespace pmcd::import {
namespace {

using codec::Scalar;

/// Values out of a binary body. A value that would reach past the end is refused before it is read.
class BinarySource {
 public:
  BinarySource(std::span<const std::byte> bytes, const PlyHeader& header)
      : bytes_(bytes), at_(header.size), big_(header.encoding == PlyEncoding::binary_big_endian) {}

  static constexpr bool kText = false;
  [[nodiscard]] std::uint64_t place() const { return item_; }

  /// Whether `count` of the element could stand in what is left; a list may be empty.
  [[nodiscard]] bool has_room_for(const PlyElement& element) const {
    const std::uint64_t least = least_bytes(element);
    return least == 0 || element.count <= (bytes_.size() - at_) / least;
  }
  bool start_item() {
    item_ = at_;
    return true;
  }
  bool end_item() { return true; }

  bool number(PlyType type, double& value) {
    const std::size_t size = ply_type_bytes(type);
    if (bytes_.size() - at_ < size) return false;
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < size; ++i) {
      bits = bits << 8 | std::to_integer<std::uint64_t>(bytes_[at_ + (big_ ? i : size - 1 - i)]);
    }
    at_ += size;
    value = as_number(type, bits);
    return true;
  }
  NumberProblem coordinate(PlyType type, Scalar, double& value) {
    if (!number(type, value)) return NumberProblem::malformed;
    return std::isfinite(value) ? NumberProblem::none : NumberProblem::non_finite;
  }
  bool skip(PlyType type, std::uint64_t count) {
    const std::size_t size = ply_type_bytes(type);
    if ((bytes_.size() - at_) / size < count) return false;
    at_ += size * count;
    return true;
  }
  /// Skips a whole element without lists at once; the caller has asked has_room_for().
  bool skip_element(const PlyElement& element) {
    if (std::any_of(element.properties.begin(), element.properties.end(), [](const auto& p) { return p.is_list; })) {
      return false;
    }
    at_ += least_bytes(element) * element.count;
    return true;
  }
  [[nodiscard]] std::string_view token() const { return {}; }

  /// First byte behind the body that is not white space; the size of the file if there is none.
  std::uint64_t rest() {
    while (at_ < bytes_.size() && as_text(bytes_).find_first_of(" \t\r\n", at_) == at_) ++at_;
    return at_;
  }

 private:
  static std::uint64_t least_bytes(const PlyElement& element) {
    std::uint64_t least = 0;
    for (const PlyProperty& p : element.properties) least += ply_type_bytes(p.is_list ? p.count_type : p.type);
    return least;
  }

  static double as_number(PlyType type, std::uint64_t bits) {
    switch (type) {
      case PlyType::int8:
        return static_cast<std::int8_t>(bits);
      case PlyType::uint8:
        return static_cast<std::uint8_t>(bits);
      case PlyType::int16:
        return static_cast<std::int16_t>(bits);
      case PlyType::uint16:
        return static_cast<std::uint16_t>(bits);
      case PlyType::int32:
        return static_cast<std::int32_t>(bits);
      case PlyType::uint32:
        return static_cast<std::uint32_t>(bits);
      case PlyType::float32:
        return std::bit_cast<float>(static_cast<std::uint32_t>(bits));
      case PlyType::float64:
        return std::bit_cast<double>(bits);
    }
    return 0;
  }

  std::span<const std::byte> bytes_;
  std::size_t at_;
  std::size_t item_ = 0;
  bool big_;
};

/// Values out of an ascii body: one item a line.
class AsciiSource {
 public:
  AsciiSource(std::span<const std::byte> bytes, const PlyHeader& header)
      : bytes_(bytes), lines_(as_text(bytes), header.size, {}), tokens_({}) {}

  static constexpr bool kText = true;
  [[nodiscard]] std::uint64_t place() const { return lines_.place(); }

  [[nodiscard]] bool has_room_for(const PlyElement&) const {
    return true;
  }  // lines that are missing show by themselves
  bool start_item() {
    const bool there = lines_.next();
    tokens_ = Tokens(lines_.line());
    return there;
  }
  bool end_item() {
    token_ = tokens_.next();
    return token_.empty();
  }
  bool number(PlyType, double& value) {
    token_ = tokens_.next();
    return parse_coordinate(token_, Scalar::float64, value) == NumberProblem::none;
  }
  NumberProblem coordinate(PlyType, Scalar scalar, double& value) {
    token_ = tokens_.next();
    return parse_coordinate(token_, scalar, value);
  }
  bool skip(PlyType, std::uint64_t count) {
    for (std::uint64_t i = 0; i < count; ++i) {
      token_ = tokens_.next();
      if (token_.empty()) return false;
    }
    return true;
  }
  bool skip_element(const PlyElement& element) { return element.properties.empty(); }
  [[nodiscard]] std::string_view token() const { return token_; }
  std::uint64_t rest() {
    lines_.next();
    return lines_.place();
  }

 private:
  std::span<const std::byte> bytes_;
  Lines lines_;
  Tokens tokens_;
  std::string_view token_;
};

int axis_of(const PlyProperty& property) {
  if (property.is_list || property.name.size() != 1) return -1;
  const char name = property.name[0];
  return name >= 'x' && name <= 'z' ? name - 'x' : -1;
}

bool is_corner_list(const PlyProperty& property) {
  return property.is_list && (property.name == "vertex_indices" || property.name == "vertex_index");
}

/// What a vertex or face property that is not kept stands for.
std::string kind_of(const std::string& name) {
  const auto one_of = [&](std::initializer_list<std::string_view> names) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  if (one_of({"red", "green", "blue", "alpha", "diffuse_red", "diffuse_green", "diffuse_blue", "r", "g", "b", "a"})) {
    return "colours";
  }
  if (one_of({"nx", "ny", "nz"})) return "normals";
  if (one_of({"s", "t", "u", "v", "texture_u", "texture_v", "texcoord"})) return "texture coordinates";
  return "other properties";
}

template <typename Source>
class PlyReader {
 public:
  PlyReader(std::span<const std::byte> bytes, const PlyHeader& header, const ReadOptions& options)
      : bytes_(bytes), header_(header), source_(bytes, header), as_double_(options.as_double) {
    mesh_.text = Source::kText;
    mesh_.scalar = options.as_double ? Scalar::float64 : Scalar::float32;
    switch (header.encoding) {
      case PlyEncoding::ascii:
        mesh_.format = "PLY, ascii";
        break;
      case PlyEncoding::binary_little_endian:
        mesh_.format = "PLY, binary little endian";
        break;
      case PlyEncoding::binary_big_endian:
        mesh_.format = "PLY, binary big endian";
        break;
    }
  }

  ImportResult<RawMesh> read() {
    if (ImportFailure failure = check_vertex_declaration()) return std::move(*failure);
    for (const PlyElement& element : header_.elements) {
      if (!source_.has_room_for(element)) return promises_too_much(element);
      ImportFailure failure;
      if (element.name == "vertex") {
        failure = each_item(element, [&](std::uint64_t i) { return vertex(element, i); });
      } else if (element.name == "face") {
        failure = each_item(element, [&](std::uint64_t i) { return face(element, i); });
      } else {
        if (element.count > 0) {
          mesh_.left_out.push_back("element '" + element.name + "', " + std::to_string(element.count) + " items");
        }
        if (source_.skip_element(element)) continue;
        failure = each_item(element, [&](std::uint64_t i) { return other(element, i); });
      }
      if (failure) return std::move(*failure);
      list_left_out(element);
    }
    if (const std::uint64_t rest = source_.rest(); rest < bytes_.size()) {
      return error_at(ImportErrorCode::trailing_data, bytes_, rest, Source::kText,
                      "the file goes on behind the last element that its header declares; correct the header's counts "
                      "or cut off what follows");
    }
    return std::move(mesh_);
  }

 private:
  ImportFailure check_vertex_declaration() {
    const auto vertex = std::find_if(header_.elements.begin(), header_.elements.end(),
                                     [](const auto& e) { return e.name == "vertex"; });
    if (vertex == header_.elements.end()) {
      return header_error("the header declares no element 'vertex'; there is no mesh in it");
    }
    int found = 0;
    for (const PlyProperty& p : vertex->properties) {
      const int axis = axis_of(p);
      if (axis < 0) continue;
      if ((found >> axis & 1) != 0) return header_error("property '" + p.name + "' of the vertices is declared twice");
      found |= 1 << axis;
      if (scalar_of(p) == Scalar::float64) mesh_.scalar = Scalar::float64;
    }
    if (found != 7) return header_error("the vertices need the properties x, y and z; at least one is missing");
    return {};
  }

  /// What a coordinate is read as: 32-bit whole numbers and doubles do not fit into a float32.
  [[nodiscard]] Scalar scalar_of(const PlyProperty& p) const {
    const bool wide = p.type == PlyType::float64 || p.type == PlyType::int32 || p.type == PlyType::uint32;
    return wide || as_double_ ? Scalar::float64 : Scalar::float32;
  }

  [[nodiscard]] ImportError header_error(std::string message) const {
    return error_at(ImportErrorCode::malformed, bytes_, header_.size > 0 ? header_.size - 1 : 0, true,
                    std::move(message));
  }

  template <typename Read>
  ImportFailure each_item(const PlyElement& element, const Read& read) {
    for (std::uint64_t i = 0; i < element.count; ++i) {
      if (!source_.start_item()) return cut_short(element, i);
      if (ImportFailure failure = read(i)) return failure;
      if (!source_.end_item()) {
        return item_error(ImportErrorCode::malformed, element, i,
                          "has more values than the header declares, from " + shown(source_.token()) + " on");
      }
    }
    return {};
  }

  ImportFailure vertex(const PlyElement& element, std::uint64_t i) {
    codec::Position position{};
    for (const PlyProperty& p : element.properties) {
      const int axis = axis_of(p);
      if (axis < 0) {
        if (ImportFailure failure = skip(element, p, i)) return failure;
        continue;
      }
      const NumberProblem problem = source_.coordinate(p.type, scalar_of(p), position[static_cast<std::size_t>(axis)]);
      if (problem == NumberProblem::none) continue;
      if (Source::kText) return coordinate_error(problem, source_.token(), scalar_of(p), bytes_, source_.place(), i);
      if (problem == NumberProblem::malformed) return cut_short(element, i);
      return item_error(ImportErrorCode::non_finite_coordinate, element, i,
                        "coordinate " + p.name + " is not finite; correct or remove the vertex");
    }
    if (!add_vertex(mesh_, position, source_.place())) return too_large_error(bytes_, source_.place(), Source::kText);
    return {};
  }

  ImportFailure face(const PlyElement& element, std::uint64_t i) {
    bool has_corners = false;
    for (const PlyProperty& p : element.properties) {
      if (!is_corner_list(p) || has_corners) {
        if (ImportFailure failure = skip(element, p, i)) return failure;
        continue;
      }
      has_corners = true;
      std::uint64_t count = 0;
      if (ImportFailure failure = list_count(element, p, i, count)) return failure;
      if (count < 3) {
        return item_error(ImportErrorCode::too_few_corners, element, i,
                          std::to_string(count) + " corners; a face needs three or more, remove it or complete it");
      }
      for (std::uint64_t c = 0; c < count; ++c) {
        double index = 0;
        if (!source_.number(p.type, index)) return bad_value(element, i);
        if (!(index >= 0) || index >= static_cast<double>(vertex_count()) || index != std::floor(index)) {
          return item_error(ImportErrorCode::index_out_of_range, element, i,
                            "corner " + std::to_string(c) + " names no vertex; there are " +
                                std::to_string(vertex_count()) + ", counted from 0");
        }
        mesh_.corners.push_back(static_cast<std::uint32_t>(index));
      }
    }
    if (!has_corners) {
      return header_error("the faces need a list property vertex_indices; export the mesh again");
    }
    if (!end_polygon(mesh_, source_.place())) return too_large_error(bytes_, source_.place(), Source::kText);
    return {};
  }

  ImportFailure other(const PlyElement& element, std::uint64_t i) {
    for (const PlyProperty& p : element.properties) {
      if (ImportFailure failure = skip(element, p, i)) return failure;
    }
    return {};
  }

  ImportFailure skip(const PlyElement& element, const PlyProperty& property, std::uint64_t i) {
    std::uint64_t count = 1;
    if (property.is_list) {
      if (ImportFailure failure = list_count(element, property, i, count)) return failure;
    }
    if (!source_.skip(property.type, count)) return bad_value(element, i);
    return {};
  }

  ImportFailure list_count(const PlyElement& element, const PlyProperty& property, std::uint64_t i,
                           std::uint64_t& count) {
    double value = 0;
    if (!source_.number(property.count_type, value)) return bad_value(element, i);
    if (!(value >= 0) || value > std::numeric_limits<std::uint32_t>::max() || value != std::floor(value)) {
      return item_error(ImportErrorCode::malformed, element, i,
                        "list '" + property.name + "' has an impossible length");
    }
    count = static_cast<std::uint64_t>(value);
    return {};
  }

  /// Faces may stand before the vertices, so the header's count is what bounds an index.
  [[nodiscard]] std::uint64_t vertex_count() const {
    for (const PlyElement& element : header_.elements) {
      if (element.name == "vertex")
        return std::min<std::uint64_t>(element.count, std::numeric_limits<std::uint32_t>::max());
    }
    return 0;
  }

  [[nodiscard]] ImportError bad_value(const PlyElement& element, std::uint64_t i) const {
    if (!Source::kText) return cut_short(element, i);
    return item_error(ImportErrorCode::malformed, element, i,
                      source_.token().empty() ? std::string("has fewer values than the header declares")
                                              : shown(source_.token()) + " is not a number; correct the line");
  }

  [[nodiscard]] ImportError item_error(ImportErrorCode code, const PlyElement& element, std::uint64_t i,
                                       const std::string& message) const {
    ImportError error = error_at(code, bytes_, source_.place(), Source::kText,
                                 element.name + " " + std::to_string(i) + " (counted from 0): " + message);
    error.element = i;
    return error;
  }

  [[nodiscard]] ImportError cut_short(const PlyElement& element, std::uint64_t i) const {
    ImportError error = error_at(ImportErrorCode::truncated, bytes_, bytes_.size(), Source::kText,
                                 "the header promises " + std::to_string(element.count) + " items of element '" +
                                     element.name + "', the file ends within number " + std::to_string(i) +
                                     " (counted from 0); it is cut short or its counts are wrong");
    error.element = i;
    return error;
  }

  [[nodiscard]] ImportError promises_too_much(const PlyElement& element) const {
    return error_at(ImportErrorCode::truncated, bytes_, bytes_.size(), Source::kText,
                    "the header promises " + std::to_string(element.count) + " items of element '" + element.name +
                        "', more than the file has bytes for; it is cut short or its counts are wrong");
  }

  void list_left_out(const PlyElement& element) {
    const bool is_vertex = element.name == "vertex";
    if ((!is_vertex && element.name != "face") || element.count == 0) return;
    for (const char* kind : {"colours", "normals", "texture coordinates", "other properties"}) {
      std::string names;
      bool corners_seen = false;
      for (const PlyProperty& p : element.properties) {
        const bool kept = is_vertex ? axis_of(p) >= 0 : is_corner_list(p) && !corners_seen;
        corners_seen = corners_seen || is_corner_list(p);
        if (!kept && kind_of(p.name) == kind) names += (names.empty() ? "" : ", ") + p.name;
      }
      if (!names.empty()) {
        mesh_.left_out.push_back(std::string(kind) + " of the " + (is_vertex ? "vertices" : "faces") + " (" + names +
                                 ")");
      }
    }
  }

  std::span<const std::byte> bytes_;
  const PlyHeader& header_;
  Source source_;
  bool as_double_;
  RawMesh mesh_;
};

}  // namespace

ImportResult<RawMesh> read_ply(std::span<const std::byte> bytes, const ReadOptions& options) {
  const ImportResult<PlyHeader> header = parse_ply_header(bytes);
  if (!header) return header.error();
  if (header->encoding == PlyEncoding::ascii) return PlyReader<AsciiSource>(bytes, *header, options).read();
  return PlyReader<BinarySource>(bytes, *header, options).read();
}

}  // namespace pmcd::import
