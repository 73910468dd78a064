// SPDX-License-Identifier: MIT
// Fetches a mesh level by level, decodes each level as it comes, and prints a table. Shows what a viewer would do, and
// no more: it neither draws nor stores.
//
//   fetch_levels HOST[:PORT] NAME
#include <pmcd/client/fetch.h>
#include <pmcd/codec/decoder.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

using namespace pmcd;

namespace {

/// Surface of a mesh: something that can be computed on every level as soon as it is there.
double area(const codec::TriangleMesh& mesh) {
  double sum = 0;
  for (const codec::Face& face : mesh.faces) {
    const codec::Position& a = mesh.positions[face[0]];
    std::array<codec::Position, 2> edges;
    for (std::size_t e = 0; e < 2; ++e) {
      const codec::Position& to = mesh.positions[face[e + 1]];
      edges[e] = {to[0] - a[0], to[1] - a[1], to[2] - a[2]};
    }
    const auto& [u, v] = edges;
    sum += std::hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]) / 2;
  }
  return sum;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: fetch_levels HOST[:PORT] NAME\n");
    return 2;
  }
  const auto address = client::parse_address(argv[1]);
  if (!address) {
    std::fprintf(stderr, "fetch_levels: %s\n", address.error().text.c_str());
    return 2;
  }

  codec::Decoder decoder;
  std::string decode_error;
  std::uint64_t bytes = 0;

  client::FetchCallbacks on;
  on.on_directory = [](const codec::Directory& directory, proto::ByteView) {
    std::printf("%zu levels, %s\n", directory.levels.size(), directory.lossless ? "lossless" : "on a lattice");
    std::printf("level       bytes    vertices       faces        area\n");
  };
  // A level is a packet that was checked; the decoder refines what it has by it. Answering false ends the fetch.
  on.on_level = [&](const client::FetchedLevel& fetched) {
    const auto level = decoder.apply(fetched.packet);
    if (!level) {
      decode_error = level.error().detail;
      return false;
    }
    bytes += fetched.packet.size();
    std::printf("%5u  %10llu  %10u  %10u  %10.4f\n", level->level, static_cast<unsigned long long>(bytes),
                level->vertices, level->faces, area(decoder.mesh()));
    std::fflush(stdout);
    return true;
  };
  // A lost line is no reason to end: the fetch goes on by itself at the byte that was reached.
  on.on_retry = [](const client::RetryNotice& retry) {
    std::fprintf(stderr, "%s; trying again in %lld ms\n", retry.error.text.c_str(),
                 static_cast<long long>(retry.pause.count()));
  };
  // Only with FetchOptions::begin_again_if_changed; else a mesh that was replaced meanwhile is an error.
  on.on_restart = [&] {
    decoder = codec::Decoder();
    bytes = 0;
  };

  client::FetchOptions options;
  options.session.agent = "fetch_levels example";
  options.begin_again_if_changed = true;
  client::MeshFetch fetch(*address, argv[2], options, std::move(on));
  const auto summary = fetch.run();
  if (!summary) {
    std::fprintf(stderr, "fetch_levels: %s\n",
                 decode_error.empty() ? summary.error().text.c_str() : decode_error.c_str());
    return 1;
  }
  std::printf("%llu bytes came, the line was lost %u times\n", static_cast<unsigned long long>(summary->bytes_received),
              summary->retries);
  return 0;
}
