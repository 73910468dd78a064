// SPDX-License-Identifier: MIT
// A program as a stranger would write it: encodes, decodes and looks for a server with nothing but the libraries that
// others link. The check beside it looks at what it links; exit code 0 means that the libraries also work alone.
#include <chrono>
#include <iostream>

#include "client/address.h"
#include "client/session.h"
#include "codec/decoder.h"
#include "codec/encoder.h"
#include "proto/frame.h"

int main() {
  using namespace pmcd;

  codec::TriangleMesh tetrahedron;
  tetrahedron.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  tetrahedron.faces = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  auto encoded = codec::encode(tetrahedron, {});
  if (!encoded) {
    std::cerr << "encoding: " << encoded.error().detail << '\n';
    return 1;
  }
  codec::Decoder decoder;
  for (const codec::EncodedPacket& packet : encoded->packets) {
    if (!decoder.apply(packet.bytes)) return 1;
  }
  if (decoder.mesh().faces.size() != tetrahedron.faces.size()) return 1;

  // Nobody listens on port 1: what counts is that the client library is linked and answers with an error.
  const auto address = client::parse_address("127.0.0.1:1");
  if (!address) return 1;
  client::Options options;
  options.connect_timeout = std::chrono::seconds(2);
  const auto session = client::Session::connect(*address, options);
  if (session) return 1;

  const char* name = proto::type_name(static_cast<std::uint16_t>(proto::FrameType::hello));
  return name != nullptr ? 0 : 1;
}
