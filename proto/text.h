// SPDX-License-Identifier: MIT
// Which texts may travel: names of meshes, error texts, names of programs. A text that reaches a terminal or a log
// holds no control character and is valid UTF-8. No locale, no normalisation.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace pmcd::proto {

inline constexpr std::size_t kMaxNameBytes = 128;
inline constexpr std::size_t kMaxErrorTextBytes = 512;
inline constexpr std::size_t kMaxAgentBytes = 64;

/// Valid UTF-8 (shortest form, no surrogates) without control characters: C0, DEL, C1, line and paragraph separator,
/// bidirectional overrides and isolates, byte-order mark.
bool is_printable_utf8(std::string_view text);

/// A mesh name: 1 to 128 bytes of printable UTF-8 without '/', not "." or "..", no space at either end.
bool is_mesh_name(std::string_view name);

/// The same text with everything that is not printable UTF-8 replaced by '?', cut to `max_bytes` between characters.
std::string printable(std::string_view text, std::size_t max_bytes);

}  // namespace pmcd::proto
