// SPDX-License-Identifier: MIT
// What is fuzzed: functions that take any bytes, drive one part of pmcd with them, and abort with a sentence when what
// must always hold does not. libFuzzer calls them (fuzz_main.cpp), and the replay test does without a fuzzer.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string_view>

namespace pmcd::fuzz {

using Input = std::span<const std::byte>;

void frames(Input input);      ///< proto::FrameReader
void messages(Input input);    ///< every message both ways, the mesh list, texts, codes
void session(Input input);     ///< net::Session, Dispatcher and Channel under a scripted client and store
void decoder(Input input);     ///< codec::Decoder behind a right checksum
void round_trip(Input input);  ///< codec::encode and back
void directory(Input input);   ///< level directories and .pmcd files
void mesh_file(Input input);   ///< the readers of codec/import; GPL, as what it links

struct Target {
  std::string_view name;
  void (*run)(Input input);
};

inline constexpr std::array<Target, 7> kTargets{{
    {"frames", frames},
    {"messages", messages},
    {"session", session},
    {"decoder", decoder},
    {"directory", directory},
    {"round_trip", round_trip},
    {"mesh_file", mesh_file},
}};

}  // namespace pmcd::fuzz
