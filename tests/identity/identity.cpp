// SPDX-License-Identifier: MIT
// identity GOLDEN-FOLDER: prints what the codec makes of the golden files and of generated meshes, as digests. Whatever
// it was compiled with, and for whatever machine, it has to print the same; check compares.
#include <cstdio>
#include <fstream>
#include <iterator>

#include "codec/packet/crc32c.h"
#include "codec/packet/directory.h"
#include "codec/proof.h"
#include "tests/codec/generated.h"
#include "tests/codec/golden.h"
#include "tests/codec/support.h"

namespace pmcd::codec::testing {
namespace {

bool decode_golden(const std::string& folder, const std::string& name) {
  std::ifstream stream(folder + "/" + name + ".pmcd", std::ios::binary);
  const std::string content((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  const Result<ParsedFile> parsed = parse_file(std::as_bytes(std::span(content.data(), content.size())));
  if (!parsed) return false;
  std::vector<std::vector<std::byte>> packets;
  for (const auto& packet : parsed->packets) packets.emplace_back(packet.begin(), packet.end());
  const std::vector<std::string> levels = level_lines(name, packets);
  for (const std::string& line : levels) std::printf("%s\n", line.c_str());
  return levels.size() == packets.size() && !levels.empty();
}

// The mesh's own digest comes first: where that differs already, the generator is to blame. The proof decodes as well,
// but its last level only is compared; the digests look at every level.
bool encode_and_decode(const std::string& name, const TriangleMesh& mesh, const EncodeOptions& options) {
  std::printf("%s: mesh %016llx", name.c_str(), static_cast<unsigned long long>(mesh_digest(mesh)));
  const Result<Encoded> encoded = encode(mesh, options);
  const Status proven = encoded ? prove(*encoded, mesh) : Status(encoded.error());
  if (!proven) {
    std::printf(" %s\n", text(proven.error()).c_str());
    return false;
  }
  std::vector<std::vector<std::byte>> packets;
  for (const EncodedPacket& packet : encoded->packets) packets.push_back(packet.bytes);
  const std::vector<std::byte> file = to_file(encoded->packets);
  std::printf(" packets %zu bytes %zu crc %08x levels", packets.size(), file.size(), crc32c(file));
  const std::vector<std::string> levels = level_lines("", packets);
  for (const std::string& line : levels) std::printf(" %s", line.substr(line.size() - 16).c_str());
  std::printf("\n");
  return levels.size() == packets.size();
}

EncodeOptions options_of(std::uint64_t seed) {
  Random random(seed ^ 0x1D);
  EncodeOptions options;
  if (!random.one_in(3)) options.bits = 4 + random.below(21);
  options.cleaning = random.one_in(3);
  if (random.one_in(3)) options.effort = Effort::best;
  if (random.one_in(3)) options.max_shape_error = random.unit();
  return options;
}

bool all(const std::string& golden_folder) {
  bool fine = true;
  for (const GoldenMesh& golden : golden_meshes()) {
    fine = decode_golden(golden_folder, golden.name) && fine;
    fine = encode_and_decode(golden.name, golden.mesh, golden.options) && fine;
  }
  for (const auto& [name, mesh] : zoo()) {
    EncodeOptions options;
    fine = encode_and_decode(name + ", lossless", mesh, options) && fine;
    options.bits = 12;
    fine = encode_and_decode(name + ", 12 bits", mesh, options) && fine;
  }
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    fine = encode_and_decode("seed " + std::to_string(seed), any_mesh(seed), options_of(seed)) && fine;
  }
  return fine;
}

}  // namespace
}  // namespace pmcd::codec::testing

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: identity GOLDEN-FOLDER\n");
    return 2;
  }
  return pmcd::codec::testing::all(argv[1]) ? 0 : 1;
}
