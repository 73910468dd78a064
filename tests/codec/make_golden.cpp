// SPDX-License-Identifier: MIT
// make_golden FOLDER: encodes the golden meshes and writes FOLDER/<name>.pmcd and FOLDER/levels.txt anew. To be run
// only when the stream was meant to change; tests/golden/README.md says when and how.
#include <cstdio>
#include <fstream>
#include <string>

#include "codec/proof.h"
#include "tests/codec/golden.h"
#include "tests/codec/support.h"

int main(int argc, char** argv) {
  using namespace pmcd::codec;
  using namespace pmcd::codec::testing;
  if (argc != 2) {
    std::fprintf(stderr, "usage: make_golden FOLDER\n");
    return 2;
  }
  const std::string folder = argv[1];
  std::ofstream levels(folder + "/levels.txt");
  levels << "# mesh level vertices faces digest; written by make_golden\n";
  for (const GoldenMesh& golden : golden_meshes()) {
    const Result<Encoded> encoded = encode(golden.mesh, golden.options);
    if (!encoded) {
      std::fprintf(stderr, "%s: %s\n", golden.name.c_str(), text(encoded.error()).c_str());
      return 1;
    }
    const Status proven = prove(*encoded, golden.mesh);
    if (!proven) {
      std::fprintf(stderr, "%s: %s\n", golden.name.c_str(), text(proven.error()).c_str());
      return 1;
    }
    std::vector<std::vector<std::byte>> packets;
    for (const EncodedPacket& packet : encoded->packets) packets.push_back(packet.bytes);
    const std::vector<std::byte> file = to_file(encoded->packets);
    std::ofstream out(folder + "/" + golden.name + ".pmcd", std::ios::binary);
    out.write(reinterpret_cast<const char*>(file.data()), static_cast<std::streamsize>(file.size()));
    for (const std::string& line : level_lines(golden.name, packets)) levels << line << "\n";
    if (!out.flush()) {
      std::fprintf(stderr, "cannot write into %s\n", folder.c_str());
      return 1;
    }
    std::printf("%s.pmcd: %zu bytes, %zu packets\n", golden.name.c_str(), file.size(), packets.size());
  }
  return levels.flush() ? 0 : 1;
}
