// SPDX-License-Identifier: GPL-3.0-or-later
// From a mesh to packets, directory and errors, and back; what is told on the way and when it is cancelled.
#include "codec/import/ingest_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "codec/import/compare.h"
#include "codec/import/measure.h"
#include "codec/import/write_mesh.h"
#include "tests/import/support.h"

namespace pmcd::import::testing {
namespace {

using enum ImportErrorCode;

ImportedMesh imported(const TriangleMesh& mesh) {
  ImportedMesh out;
  out.mesh = mesh;
  return out;
}

TEST(Ingest, DirectoryHoldsTheErrorOfEachLevel) {
  const TriangleMesh mesh = torus(40, 30);
  const auto done = ingest_mesh(imported(mesh), "torus", {});
  ASSERT_TRUE(done.ok()) << to_line(done.error());
  EXPECT_GT(done->encode_seconds, 0);
  EXPECT_GT(done->prove_seconds, 0);
  EXPECT_GT(done->measure_seconds, 0);
  ASSERT_EQ(done->directory.levels.size(), done->packets.size());
  const std::vector<std::byte> file = to_file_bytes(*done);
  const ErrorMeter meter(mesh);
  for (std::uint32_t k = 0; k < done->packets.size(); ++k) {
    const auto level = decode_file_bytes(file, k, "torus.pmcd");
    ASSERT_TRUE(level.ok()) << to_line(level.error());
    const Distance d = meter.distance_to(*level);
    EXPECT_EQ(done->directory.levels[k].error_rms, d.rms);
    EXPECT_EQ(done->directory.levels[k].error_max, d.max);
    EXPECT_EQ(done->directory.levels[k].vertices, level->positions.size());
    EXPECT_TRUE(is_valid_cgal(*level));
  }
  EXPECT_EQ(done->directory.levels.back().error_max, 0);
  const auto last = decode_file_bytes(file, std::nullopt, "torus.pmcd");
  ASSERT_TRUE(last.ok());
  EXPECT_TRUE(compare_meshes(mesh, *last).same);
}

TEST(Ingest, BoxIsTheOriginals) {
  IngestOptions options;
  options.encode.bits = 4;
  options.measure_errors = false;
  const auto done = ingest_mesh(imported(torus(16, 12)), "torus", options);
  ASSERT_TRUE(done.ok()) << to_line(done.error());
  EXPECT_EQ(done->directory.box_min, (Position{-4, -4, -1}));
  EXPECT_EQ(done->directory.box_max, (Position{4, 4, 1}));
  EXPECT_LT(done->directory.levels.back().error_max, 0);
  EXPECT_GT(done->prove_seconds, 0);
  EXPECT_EQ(done->measure_seconds, 0);
}

// What the encoder got wrong must not get out, whether errors are measured or not.
TEST(Ingest, NothingComesOutIfTheProofFails) {
  const TriangleMesh mesh = torus(16, 12);
  const auto good = codec::encode(mesh, {});
  ASSERT_TRUE(good.ok());
  ASSERT_GE(good->packets.size(), 3u);
  codec::Encoded moved = *good;
  std::swap(moved.claim.to_original[3], moved.claim.to_original[4]);
  codec::Encoded incomplete = *good;
  incomplete.claim.to_original.pop_back();
  TriangleMesh other = mesh;
  other.positions[7][2] = 0.5;
  for (const bool measure_errors : {false, true}) {
    IngestOptions options;
    options.measure_errors = measure_errors;
    EXPECT_TRUE(ingest_encoded(*good, mesh, "torus", options).ok());
    for (const auto& done :
         {ingest_encoded(moved, mesh, "torus", options), ingest_encoded(incomplete, mesh, "torus", options),
          ingest_encoded(*good, other, "torus", options)}) {
      ASSERT_FALSE(done.ok());
      EXPECT_EQ(done.error().code, encoder_refused);
      EXPECT_EQ(done.error().file, "torus");
      EXPECT_EQ(done.error().message.find("the encoder's proof failed: "), 0u) << done.error().message;
      EXPECT_NE(done.error().message.find("(internal_error)"), std::string::npos) << done.error().message;
    }
  }
}

TEST(Ingest, ProgressRisesAndCancelsInEveryStage) {
  TemporaryFolder folder;
  const std::string file = folder.file("torus.ply");
  ASSERT_TRUE(write_mesh(file, torus(40, 30)).ok());
  for (const bool measure_errors : {false, true}) {
    const IngestStage last = measure_errors ? IngestStage::measuring : IngestStage::proving;
    std::vector<std::pair<IngestStage, double>> told;
    IngestOptions options;
    options.measure_errors = measure_errors;
    options.progress = [&](IngestStage stage, double fraction) {
      told.emplace_back(stage, fraction);
      return true;
    };
    ASSERT_TRUE(ingest_file(file, options).ok());
    EXPECT_TRUE(std::is_sorted(told.begin(), told.end()));
    EXPECT_EQ(told.back(), std::pair(last, 1.0));
    std::set<IngestStage> stages;
    for (const auto& [stage, fraction] : told) stages.insert(stage);
    EXPECT_EQ(stages, (std::set<IngestStage>{IngestStage::reading, IngestStage::encoding, last}));
    for (std::size_t stop = 0; stop < told.size(); ++stop) {
      std::size_t asked = 0;
      options.progress = [&](IngestStage, double) { return asked++ < stop; };
      const auto done = ingest_file(file, options);
      ASSERT_FALSE(done.ok()) << stop;
      EXPECT_EQ(done.error().code, cancelled);
      EXPECT_EQ(done.error().file, file);
      EXPECT_EQ(asked, stop + 1) << "nothing is asked after a no";
    }
  }
}

TEST(Ingest, StagesHaveNames) {
  EXPECT_STREQ(stage_name(IngestStage::reading), "reading");
  EXPECT_STREQ(stage_name(IngestStage::encoding), "encoding");
  EXPECT_STREQ(stage_name(IngestStage::proving), "proving");
  EXPECT_STREQ(stage_name(IngestStage::measuring), "measuring");
}

TEST(Ingest, ErrorsAreNamed) {
  IngestOptions options;
  options.encode.bits = 25;
  auto done = ingest_mesh(imported(tetrahedron()), "t", options);
  ASSERT_FALSE(done.ok());
  EXPECT_EQ(done.error().code, invalid_option);
  TriangleMesh broken = tetrahedron();
  broken.faces[0] = {0, 1, 1};
  done = ingest_mesh(imported(broken), "t", {});
  ASSERT_FALSE(done.ok());
  EXPECT_EQ(done.error().code, encoder_refused);
  EXPECT_NE(done.error().message.find("repeated_index_in_face"), std::string::npos);
  EXPECT_EQ(ingest_file("/nowhere/a.ply", {}).error().code, cannot_read);
}

TEST(DecodeFileBytes, RefusesByName) {
  const auto done = ingest_mesh(imported(torus(10, 8)), "torus", {});
  ASSERT_TRUE(done.ok());
  std::vector<std::byte> file = to_file_bytes(*done);
  const auto beyond = decode_file_bytes(file, 1000, "a.pmcd");
  ASSERT_FALSE(beyond.ok());
  EXPECT_EQ(beyond.error().code, invalid_option);
  EXPECT_EQ(beyond.error().file, "a.pmcd");
  file.pop_back();
  const auto cut = decode_file_bytes(file, std::nullopt, "a.pmcd");
  ASSERT_FALSE(cut.ok());
  EXPECT_EQ(cut.error().code, bad_packet_file);
}

}  // namespace
}  // namespace pmcd::import::testing
