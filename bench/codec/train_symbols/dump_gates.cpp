// SPDX-License-Identifier: MIT
// Writes what the symbol model sees at each gate of meshes, and whether its face stays, for train.py. It encodes each
// mesh and decodes it with a reader of its own, for which it specialises SymbolModel::code_face.
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "codec/base/base_mesh.h"
#include "codec/encoder.h"
#include "codec/import/read_mesh.h"
#include "codec/packet/base_header.h"
#include "codec/packet/header.h"
#include "codec/refine.h"
#include "codec/tail.h"

namespace pmcd::codec {
namespace {

// As train.py reads it.
struct __attribute__((packed)) SeenGate {
  std::uint8_t kind = 0;
  std::uint8_t null = 0;
  std::uint8_t state = 0;
  std::uint8_t parent = 0;
  std::array<std::uint16_t, kFaceCorners> corner{};
  std::array<float, kFaceInputs> input{};
  float weight = 1;
};

class GateReader : public PacketReader {
 public:
  GateReader(std::span<const std::byte> coded, std::vector<SeenGate>& gates) : PacketReader(coded), gates_(gates) {}
  void saw(const SeenGate& gate) { gates_.push_back(gate); }

 private:
  std::vector<SeenGate>& gates_;
};

}  // namespace

template <>
bool SymbolModel::code_face<GateReader>(GateReader& source, const FaceView& view, std::size_t state, std::size_t parent,
                                        float share, bool stays) {
  SeenGate seen;
  seen.kind = static_cast<std::uint8_t>(kind_);
  seen.state = static_cast<std::uint8_t>(state);
  seen.parent = static_cast<std::uint8_t>(parent);
  seen.corner = view.corner;
  seen.input = view.input.value;
  seen.null = source.bit_at(chance_against(share, 1.0f), stays) ? 1 : 0;
  source.saw(seen);
  return seen.null != 0;
}

namespace {

bool decode(const Encoded& encoded, std::vector<SeenGate>& gates) {
  LevelState state;
  for (const auto& packet : encoded.packets) {
    const std::span<const std::byte> bytes = packet.bytes;
    const Result<PacketHeader> header = check_packet(bytes);
    if (!header) return false;
    std::span<const std::byte> payload = bytes.subspan(header->size);
    if (header->is_base()) {
      const Result<BaseHeader> base = parse_base_header(payload);
      if (!base) return false;
      state.lattice = base->lattice;
      payload = payload.subspan(base->size);
    }
    GateReader reader(payload, gates);
    const LevelBounds bounds{header->vertices, header->faces};
    Status status = header->is_base()
                        ? code_base_level(state, reader, bounds.vertices, bounds.faces, header->missing_digits)
                        : code_passes(state, bounds, header->missing_digits, reader);
    if (status) status = code_isolated(state, bounds.vertices, reader);
    if (!status) return false;
  }
  return true;
}

}  // namespace
}  // namespace pmcd::codec

int main(int count, char** arguments) {
  using namespace pmcd;
  if (count < 4) {
    std::fputs("usage: dump_gates BITS GATES MESH...\n", stderr);
    return 2;
  }
  std::FILE* out = std::fopen(arguments[2], "wb");
  if (out == nullptr) return 1;
  for (int i = 3; i < count; ++i) {
    const auto input = import::read_mesh(arguments[i]);
    if (!input) {
      std::fprintf(stderr, "%s: not read\n", arguments[i]);
      continue;
    }
    codec::EncodeOptions options;
    options.bits = static_cast<unsigned>(std::atoi(arguments[1]));
    std::vector<codec::SeenGate> gates;
    for (const bool cleaning : {false, true}) {
      options.cleaning = cleaning;
      const auto encoded = codec::encode(input->mesh, options);
      if (!encoded || !codec::decode(*encoded, gates)) std::fprintf(stderr, "%s: not coded\n", arguments[i]);
    }
    // Large meshes say less a gate.
    const float weight = 100.0f / std::sqrt(static_cast<float>(gates.size() + 1));
    for (codec::SeenGate& gate : gates) gate.weight = weight;
    std::fwrite(gates.data(), sizeof gates[0], gates.size(), out);
    std::fprintf(stderr, "%s: %zu gates\n", arguments[i], gates.size());
  }
  return std::fclose(out) == 0 ? 0 : 1;
}
