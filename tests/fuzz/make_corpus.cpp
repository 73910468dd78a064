// SPDX-License-Identifier: GPL-3.0-or-later
// make_corpus FOLDER: writes the seeds of all fuzzers, FOLDER/<target>/<name>, from generated meshes and from the
// samples of the protocol. The same files at each run.
#include <array>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "codec/import/write_mesh.h"
#include "codec/packet/directory.h"
#include "codec/packet/header.h"
#include "proto/mesh_list.h"
#include "tests/codec/generated.h"
#include "tests/fuzz/sample_meshes.h"
#include "tests/fuzz/target.h"
#include "tests/proto/samples.h"

namespace pmcd::fuzz {
namespace {

using Bytes = std::vector<std::byte>;

Bytes bytes(std::initializer_list<int> values) {
  Bytes out;
  for (const int value : values) out.push_back(static_cast<std::byte>(value));
  return out;
}

Bytes operator+(Bytes a, Input b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

class Corpus {
 public:
  explicit Corpus(std::filesystem::path folder) : folder_(std::move(folder)) {}

  void add(const std::string& target, const std::string& name, const Bytes& content) {
    std::filesystem::create_directories(folder_ / target);
    std::ofstream out(folder_ / target / name, std::ios::binary);
    out.write(reinterpret_cast<const char*>(content.data()), static_cast<std::streamsize>(content.size()));
    failed_ = failed_ || !out.flush();
  }
  [[nodiscard]] bool failed() const { return failed_; }

 private:
  std::filesystem::path folder_;
  bool failed_ = false;
};

Bytes copy(Input from) {
  return {from.begin(), from.end()};
}

Bytes text(std::string_view from) {
  return copy(std::as_bytes(std::span(from)));
}

void protocol(Corpus& corpus) {
  Bytes clients;
  Bytes servers;
  int number = 0;
  for (const auto& sample : proto::testing::all_samples()) {
    corpus.add("messages", sample.name, copy(Input(sample.encoded).subspan(proto::kLengthBytes)));
    Bytes& stream = ++number <= 13 ? clients : servers;
    stream = stream + sample.encoded;
  }
  proto::MeshListEntry entry;
  entry.name = "cube";
  entry.levels = 1;
  const proto::MeshPage page{2, 1, {entry}};
  corpus.add("messages", "mesh_page", bytes({0xff, 0xff}) + proto::encode_mesh_page(page));
  corpus.add("messages", "text", bytes({0xfe, 0xff}) + text("plain, \xc3\xa4\xe2\x82\xac \x1b[0m \xe2\x80\xae"));
  corpus.add("messages", "code", bytes({0xfd, 0xff, 35, 0}));

  const Bytes empty = proto::make_frame(proto::FrameType::goodbye, {});
  corpus.add("frames", "client", bytes({0, 0}) + clients);
  corpus.add("frames", "server_cut", bytes({1, 3, 1, 7, 40}) + servers);
  corpus.add("frames", "data_unfinished", bytes({4, 1, 9}) + Input(servers).first(servers.size() - 3));
  corpus.add("frames", "admin", bytes({2, 2, 0, 5}) + empty);
  corpus.add("frames", "length_1", bytes({0, 0, 1, 0, 0, 0, 6, 0}));
  corpus.add("frames", "too_long", bytes({3, 0}) + empty + bytes({0xff, 0xff, 0xff, 0xff, 1, 0}));
}

/// A session that stands: slots and sizes, settings, what "a" and "b" hold; "ab" and "c" are absent.
Bytes standing(int sizes, int setting, int a, int b) {
  return bytes({sizes, setting, a, b, 1, 1});
}

void sessions(Corpus& corpus) {
  // Actions as session.cpp numbers them; 32 more for the second client, 64 more for the third.
  const auto base = [](int id, int name) { return bytes({0, id, name}); };
  const auto next = [](int id, int handle) { return bytes({2, id, handle}); };
  const auto exact = [](int id, int content, int choice, int offset) {
    return bytes({5, id, content, choice, offset & 0xff, offset >> 8});
  };
  const auto cancel = [](int id) { return bytes({8, id}); };
  const Bytes settle = bytes({30, 0});
  const Bytes look = bytes({21, 22});
  corpus.add("session", "fetch", standing(0, 1, 1, 4) + base(1, 0) + settle + next(2, 1) + next(3, 0) + next(4, 1));
  corpus.add("session", "list", standing(0, 0, 1, 4) + bytes({7, 1, 0}) + bytes({7, 2, 5, 0}) + bytes({7, 3, 14, 1}));
  corpus.add("session", "cancel_running",
             standing(1, 0, 3, 5) + base(1, 0) + base(2, 1) + bytes({17, 40, 20, 9}) + cancel(1) + cancel(2) + look);
  corpus.add("session", "cancel_waiting",
             standing(0, 0, 3, 5) + base(1, 0) + next(2, 1) + cancel(2) + cancel(1) + settle);
  corpus.add("session", "resume",
             standing(0, 0, 1, 5) + exact(1, 1, 130, 77) + settle + next(2, 0) + exact(3, 3, 0, 9));
  corpus.add(
      "session", "late_store",
      standing(5, 2, 1, 3) + base(1, 0) + bytes({18, 23, 0, 18}) + next(2, 1) + next(3, 1) + bytes({18, 25, 0, 18}));
  corpus.add("session", "replaced",
             standing(0, 0, 1, 2) + base(1, 0) + settle + bytes({27, 0, 3}) + next(2, 1) + base(3, 0) + settle +
                 bytes({29, 0}) + next(4, 1));
  corpus.add(
      "session", "removed",
      standing(0, 0, 1, 2) + base(1, 0) + settle + bytes({28, 0}) + next(2, 1) + bytes({18, 29, 0}) + next(3, 1));
  Bytes many = standing(0, 0, 3, 3);
  for (int i = 0; i < 12; ++i) many = many + next(i, 1);
  corpus.add("session", "too_many", base(1, 0) + many + settle);
  corpus.add("session", "open_beyond_eight",
             standing(0, 2, 3, 3) + base(0, 0) + settle + next(1, 1) + next(2, 1) + next(3, 1) + next(4, 1) +
                 next(5, 1) + next(6, 1) + next(7, 1) + next(8, 1) + next(9, 1) + settle);
  corpus.add("session", "duplicate", standing(0, 2, 3, 3) + base(1, 0) + settle + next(2, 1) + next(2, 1) + settle);
  corpus.add("session", "three_clients",
             standing(2, 9, 3, 5) + bytes({0, 1, 0, 32, 1, 1, 64, 1, 0, 34, 2, 1, 66, 2, 1}));
  corpus.add("session", "slow_reader",
             standing(0x40, 5, 3, 5) + bytes({0, 1, 0, 32, 1, 1, 18, 20, 3, 21, 22, 18, 20, 9, 21, 22, 52, 1}));
  corpus.add("session", "not_joined", standing(0, 32, 1, 1) + base(1, 0) + cancel(3) + bytes({16}) + base(1, 0));
  corpus.add("session", "hello_late", standing(0, 48, 1, 1) + bytes({13, 1, 30, 1, 16}) + base(1, 0));
  corpus.add("session", "ping_and_unknown",
             standing(0, 0, 1, 1) + bytes({10, 7, 11, 1, 0x77, 4, 1, 2, 3, 4, 11, 0, 0x78, 4, 9, 0, 0, 0}));
  corpus.add("session", "pieces", standing(0, 0, 1, 1) + bytes({14, 1, 1}) + base(1, 0) + next(2, 1) + cancel(2));
  corpus.add("session", "garbage", standing(0, 0, 1, 1) + bytes({12, 1, 6, 1, 0, 0, 0, 9, 9}));
  corpus.add("session", "data_garbage", standing(0, 0, 3, 1) + base(1, 0) + bytes({18, 12, 0, 6, 1, 0, 0, 0, 9, 9}));
  corpus.add("session", "goodbye", standing(0, 0, 3, 1) + base(1, 0) + bytes({18, 13, 0}));
  corpus.add("session", "data_closed", standing(0, 4, 3, 1) + base(1, 0) + bytes({18, 15, 0, 0, 32, 1, 0}));
  corpus.add("session", "drain", standing(0, 4, 3, 5) + base(1, 0) + bytes({18, 31, 0, 32, 1, 1}) + cancel(1));
}

/// Inputs of round_trip: options, then the number of a draw, a shape, and changes as round_trip.cpp numbers them.
void meshes(Corpus& corpus) {
  const Bytes lossless = bytes({0, 0});
  const Bytes bits_12 = bytes({10, 0});
  const Bytes best = bytes({0, 2});
  const auto shape = [](int kind, int a, int b) { return bytes({7, kind, a, b}); };
  const Bytes big_grid = shape(0, 11, 10) + bytes({5});
  const Bytes ball = shape(2, 10, 9);
  corpus.add("round_trip", "empty", lossless + shape(11, 0, 0));
  corpus.add("round_trip", "grid", bits_12 + big_grid + bytes({6, 7}));
  corpus.add("round_trip", "grid_best", bytes({12, 3}) + big_grid + bytes({6, 9, 3, 60}));
  corpus.add("round_trip", "sphere", bytes({14, 0}) + shape(1, 2, 0) + bytes({6, 6, 5}));
  corpus.add("round_trip", "sphere_best", best + shape(1, 2, 0) + bytes({6, 6}));
  corpus.add("round_trip", "torus_double", lossless + shape(3, 7, 6) + bytes({7, 3, 40}));
  corpus.add("round_trip", "torus_one_packet", bytes({11, 4, 0}) + shape(3, 8, 8) + bytes({6, 8}));
  corpus.add("round_trip", "torus_lossless_two", bytes({0, 4, 1}) + shape(3, 8, 8) + bytes({6, 8}));
  corpus.add("round_trip", "plate", bytes({14, 1}) + shape(4, 1, 1) + bytes({6, 10}));
  corpus.add("round_trip", "limits", bytes({10, 24, 160, 20}) + ball + bytes({3, 200, 6, 4}));
  corpus.add("round_trip", "cone", bits_12 + shape(6, 11, 2) + bytes({2, 30}));
  corpus.add("round_trip", "bipyramid", lossless + shape(5, 9, 2) + bytes({2, 60, 6, 12}));
  corpus.add("round_trip", "components", bits_12 + ball + bytes({0, 3, 1, 2, 1, 0, 8, 0, 0, 2, 4, 9, 5}));
  corpus.add("round_trip", "many_components", bits_12 + shape(9, 0, 0) + bytes({1, 39, 9, 0, 0, 1, 1, 39, 8, 0, 0, 2}));
  // Bases that levels do not pay for: everything in one packet is tried too.
  corpus.add("round_trip", "many_octahedra", bits_12 + shape(10, 0, 0) + bytes({1, 39, 10, 0, 0, 1, 6, 8}));
  corpus.add("round_trip", "many_octahedra_lossless", best + shape(10, 0, 0) + bytes({1, 39, 10, 0, 0, 1, 6, 8, 7}));
  corpus.add("round_trip", "isolated", lossless + shape(9, 0, 0) + bytes({4, 39, 19, 1, 2, 3, 19, 4, 5, 6}));
  corpus.add("round_trip", "squashed", bits_12 + ball + bytes({9, 39, 10, 11, 2, 0}));
  corpus.add("round_trip", "flat", lossless + big_grid + bytes({11, 2, 1}));
  corpus.add("round_trip", "grid_of_numbers", lossless + ball + bytes({12, 6, 0}));
  corpus.add("round_trip", "grid_with_strays", lossless + ball + bytes({12, 6, 20}));
  corpus.add("round_trip", "stepped", lossless + ball + bytes({12, 7, 0, 18, 0, 3, 20}));
  corpus.add("round_trip", "decimals", lossless + ball + bytes({6, 5, 13, 5, 0}));
  corpus.add("round_trip", "decimals_some", lossless + ball + bytes({6, 5, 13, 5, 0, 13, 2, 2}));
  corpus.add("round_trip", "decimals_moved", lossless + ball + bytes({6, 5, 13, 4, 0, 18, 1, 7, 29}));
  corpus.add("round_trip", "few_values", lossless + ball + bytes({6, 5, 14, 0, 8, 14, 1, 8, 14, 2, 8}));
  corpus.add("round_trip", "tiny", lossless + ball + bytes({8, 3, 10}));
  corpus.add("round_trip", "huge", lossless + ball + bytes({8, 240}));
  corpus.add("round_trip", "one_far_away", bits_12 + ball + bytes({15, 3, 0, 0, 0, 0, 0x80, 0x4b}));
  corpus.add("round_trip", "not_a_number", bits_12 + ball + bytes({15, 3, 0, 0, 0, 0, 0xc0, 0x7f}));
  corpus.add("round_trip", "fan_of_two", bits_12 + big_grid + bytes({16, 9, 0, 16, 40, 0}));
  corpus.add("round_trip", "face_too_many", bits_12 + ball + bytes({17, 0, 1, 2}));
}

void codec_seeds(Corpus& corpus) {
  const auto& samples = sample_packets();
  for (std::size_t mesh = 0; mesh < samples.size(); ++mesh) {
    std::vector<Input> spans;
    for (std::size_t level = 0; level < samples[mesh].size(); ++level) {
      const Bytes& packet = samples[mesh][level];
      spans.emplace_back(packet);
      if (level > 3 && level + 1 != samples[mesh].size()) continue;
      corpus.add("decoder", std::to_string(mesh) + "_" + std::to_string(level),
                 bytes({static_cast<int>(mesh) + 1, static_cast<int>(level)}) + packet);
    }
    const auto directory = codec::make_directory(spans);
    Bytes file = codec::serialize(directory.value());
    corpus.add("directory", "directory_" + std::to_string(mesh), bytes({0}) + file);
    for (const Input packet : spans) file = file + packet;
    corpus.add("directory", "file_" + std::to_string(mesh), bytes({static_cast<int>(mesh % 2)}) + file);
  }
  corpus.add("decoder", "header_only",
             bytes({0, 0}) + Input(samples[0][0]).first(codec::parse_packet_header(samples[0][0])->size));

  const codec::TriangleMesh mesh = codec::testing::torus(4, 3);
  const std::array<std::string, 4> extensions{"ply", "obj", "off", "stl"};
  for (int i = 0; i < 4; ++i) {
    const std::string& extension = extensions[static_cast<std::size_t>(i)];
    corpus.add("mesh_file", extension, bytes({i}) + import::format_mesh(mesh, extension)->bytes);
  }
  corpus.add("mesh_file", "polygons.obj",
             bytes({1}) + text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv .5 2 \\\n0\n"
                               "f 1/1 2//2 3 -2 5\n"));
  corpus.add("mesh_file", "ascii.stl",
             bytes({7}) + text("solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n"
                               "vertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n"));
  corpus.add("mesh_file", "ascii.ply",
             bytes({8}) + text("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                               "property float z\nproperty list uchar float w\nelement face 1\n"
                               "property list uchar int vertex_indices\nproperty uchar red\nend_header\n"
                               "0 0 0 1 5\n1 0 0 0\n0 1e0 0 2 1 1\n3 0 1 2 7\n"));
}

}  // namespace
}  // namespace pmcd::fuzz

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: make_corpus FOLDER\n");
    return 2;
  }
  pmcd::fuzz::Corpus corpus(argv[1]);
  pmcd::fuzz::protocol(corpus);
  pmcd::fuzz::sessions(corpus);
  pmcd::fuzz::codec_seeds(corpus);
  pmcd::fuzz::meshes(corpus);
  return corpus.failed() ? 1 : 0;
}
