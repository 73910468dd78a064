// SPDX-License-Identifier: MIT
// docs/PROTOCOL.md against the code: the table of codes, the table of types, the limits and the worked example.
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "proto/admin.h"
#include "proto/admin_rules.h"
#include "proto/codes.h"
#include "proto/mesh_list.h"
#include "proto/text.h"
#include "tests/proto/samples.h"

namespace pmcd::proto {
namespace {

std::vector<std::string> document_lines() {
  std::ifstream in(PMCD_PROTOCOL_DOCUMENT);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

/// Cells of a table's line, without the blanks and back-quotes around them.
std::vector<std::string> cells(const std::string& line) {
  std::vector<std::string> out;
  std::istringstream in(line);
  std::string cell;
  std::getline(in, cell, '|');
  while (std::getline(in, cell, '|')) {
    const auto first = cell.find_first_not_of(" `");
    const auto last = cell.find_last_not_of(" `");
    out.push_back(first == std::string::npos ? "" : cell.substr(first, last - first + 1));
  }
  return out;
}

/// The lines of the table that follows `heading`, without its two head lines.
std::vector<std::vector<std::string>> table_after(const std::string& heading) {
  std::vector<std::vector<std::string>> rows;
  bool below = false;
  for (const std::string& line : document_lines()) {
    if (line.rfind('#', 0) == 0) {
      if (below) break;
      below = line == heading;
    } else if (below && line.rfind('|', 0) == 0) {
      rows.push_back(cells(line));
    }
  }
  if (rows.size() >= 2) rows.erase(rows.begin(), rows.begin() + 2);
  return rows;
}

std::string hex16(std::uint16_t value) {
  std::ostringstream out;
  out << "0x" << std::hex;
  out.width(4);
  out.fill('0');
  out << value;
  return out.str();
}

TEST(Document, TableOfCodes) {
  std::vector<std::vector<std::string>> expected;
  for (const CodeInfo& info : all_codes()) {
    expected.push_back({std::to_string(static_cast<std::uint16_t>(info.code)), std::string(info.name),
                        std::string(ends_name(info.ends)), std::string(info.sentence)});
  }
  const auto rows = table_after("## Error codes");
  ASSERT_EQ(rows.size(), expected.size());
  for (std::size_t i = 0; i < rows.size(); ++i) EXPECT_EQ(rows[i], expected[i]) << "line " << i;
}

TEST(Document, TablesOfTypes) {
  std::map<std::string, std::string> documented;
  for (const char* heading : {"## Messages of a session", "## The admin channel"}) {
    for (const auto& row : table_after(heading)) {
      ASSERT_GE(row.size(), 2u);
      EXPECT_TRUE(documented.emplace(row[0], row[1]).second) << row[0] << " stands twice";
    }
  }
  std::map<std::string, std::string> known;
  for (unsigned type = 0; type <= 0xffff; ++type) {
    const auto number = static_cast<std::uint16_t>(type);
    if (const char* name = type_name(number)) known.emplace(hex16(number), name);
  }
  EXPECT_EQ(documented, known);
}

TEST(Document, Limits) {
  std::map<std::string, std::string> documented;
  for (const auto& row : table_after("## Limits")) {
    ASSERT_GE(row.size(), 2u);
    documented.emplace(row[0], row[1]);
  }
  const std::map<std::string, std::string> expected{
      {"length field, client to server", std::to_string(kMaxClientFrame)},
      {"length field, server to client, request channel", std::to_string(kMaxAnswerFrame)},
      {"length field, server to client, data channel", std::to_string(kMaxDataFrame)},
      {"length field, admin channel, both ways", std::to_string(kMaxAdminFrame)},
      {"bytes in a chunk, an ingest_data or an admin_answer", std::to_string(kMaxChunkBytes)},
      {"bytes of a level directory", std::to_string(kMaxDirectoryBytes)},
      {"meshes on a page of the mesh list", std::to_string(kMaxPageEntries)},
      {"live handles of a session", std::to_string(kMaxLiveHandles)},
      {"open requests of a session", std::to_string(kMaxOpenRequests)},
      {"bytes of a mesh name, of filter and of after", std::to_string(kMaxNameBytes)},
      {"bytes of an agent's name", std::to_string(kMaxAgentBytes)},
      {"bytes of the text of an error or a notice", std::to_string(kMaxErrorTextBytes)},
      {"seconds a token is good", std::to_string(kJoinSeconds)},
  };
  EXPECT_EQ(documented, expected);
}

using Frames = std::vector<std::pair<std::string, Bytes>>;

/// The first worked example as the document should have it: label, frame.
Frames fetch_example() {
  const ChunkHeader header{1, 1, 0, 0, 10};
  const Bytes packet = testing::text_bytes("0123456789");
  ChunkHeader second = header;
  second.offset = 6;
  return {
      {"client, request: hello", encode(Hello{{1, 0}, "example 1"})},
      {"server, request: hello_ok", encode(HelloOk{{1, 0}, testing::counting_token(), 7622, 30, 8, "pmcd 0.1.0"})},
      {"client, data: join", encode(Join{{1, 0}, testing::counting_token()})},
      {"server, data: join_ok", encode(JoinOk{{1, 0}})},
      {"client, request: get_base_mesh", encode(GetBaseMesh{1, "cube"})},
      {"server, request: mesh_opened", encode(MeshOpened{1, 1, 0x1122334455667788, testing::text_bytes("DIRECTORY")})},
      {"server, data: chunk", testing::chunk_frame(header, ByteView(packet).first(6))},
      {"server, data: chunk", testing::chunk_frame(second, ByteView(packet).subspan(6))},
      {"server, data: transfer_end", encode(TransferEnd{1, TransferResult::complete, ErrorCode::none})},
      {"client, request: get_next_packet", encode(GetNextPacket{2, 0})},
      {"server, data: transfer_end", encode(TransferEnd{2, TransferResult::end_of_mesh, ErrorCode::none})},
      {"client, request: get_base_mesh", encode(GetBaseMesh{3, "sphere"})},
      {"server, request: error", encode(ErrorMessage{3, ErrorCode::unknown_mesh, "there is no mesh \"sphere\""})},
      {"client, request: goodbye", encode(Goodbye{})},
  };
}

/// The second one.
Frames resume_example() {
  constexpr std::uint64_t kGeneration = 0x1122334455667788;
  const Bytes directory = testing::text_bytes("DIRECTORY");
  const Bytes packet = testing::text_bytes("0123456789");
  MeshListEntry cube;
  cube.name = "cube";
  cube.generation = kGeneration;
  cube.vertices = 8;
  cube.faces = 12;
  cube.levels = 1;
  cube.bytes = packet.size();
  cube.lossless = true;
  cube.bits = 14;
  cube.box_max = {1, 1, 1};
  const Bytes page = encode_mesh_page({1, 0, {cube}});
  return {
      {"client, request: get_base_mesh", encode(GetBaseMesh{1, "cube"})},
      {"server, request: mesh_opened", encode(MeshOpened{1, 1, kGeneration, directory})},
      {"server, data: chunk", testing::chunk_frame({1, 1, 0, 0, 10}, ByteView(packet).first(6))},
      {"client, request: cancel", encode(Cancel{1})},
      {"server, data: transfer_end", encode(TransferEnd{1, TransferResult::cancelled, ErrorCode::none})},
      {"client, request: goodbye", encode(Goodbye{})},
      {"client, request: get_packet", encode(GetPacket{7, kGeneration, 0, 6})},
      {"server, request: mesh_opened", encode(MeshOpened{7, 1, kGeneration, directory})},
      {"server, data: chunk", testing::chunk_frame({7, 1, 0, 6, 10}, ByteView(packet).subspan(6))},
      {"server, data: transfer_end", encode(TransferEnd{7, TransferResult::complete, ErrorCode::none})},
      {"client, request: get_mesh_list", encode(GetMeshList{8, "CUB", "", 1})},
      {"server, data: chunk", testing::chunk_frame({8, 0, 0, 0, page.size()}, page)},
      {"server, data: transfer_end", encode(TransferEnd{8, TransferResult::complete, ErrorCode::none})},
      {"server, request: notice", encode(Notice{NoticeKind::mesh_retired, 1, 600, "gone"})},
  };
}

/// The third one.
Frames version_example() {
  return {
      {"client, request: hello", encode(Hello{{2, 0}, "later 2"})},
      {"server, request: error",
       encode(ErrorMessage{0, ErrorCode::unsupported_version, "this server speaks version 1"})},
      {"client, request: ping", encode(Ping{9})},
      {"server, request: pong", encode(Pong{9})},
  };
}

Bytes ingest_data_frame(std::uint64_t offset, std::string_view bytes) {
  const auto header = encode_ingest_data_header({1, 0, offset}, static_cast<std::uint32_t>(bytes.size()));
  Bytes frame(header.begin(), header.end());
  const Bytes payload = testing::text_bytes(bytes);
  frame.insert(frame.end(), payload.begin(), payload.end());
  return frame;
}

/// The fourth one.
Frames ingest_example() {
  constexpr std::uint64_t kGeneration = 0x1122334455667788;
  return {
      {"client, admin: admin_hello", encode(AdminHello{{1, 0}, "example 1"})},
      {"server, admin: admin_hello_ok", encode(AdminHelloOk{{1, 0}, "pmcd 0.1.0"})},
      {"client, admin: ingest_begin", encode(IngestBegin{1, true, "cube", testing::text_bytes("DIRECTORY")})},
      {"server, admin: ingest_ready", encode(IngestReady{1})},
      {"client, admin: ingest_data", ingest_data_frame(0, "012345")},
      {"client, admin: ingest_data", ingest_data_frame(6, "6789")},
      {"client, admin: ingest_commit", encode(IngestCommit{1})},
      {"server, admin: ingest_ok", encode(IngestOk{1, kGeneration, false})},
      {"client, admin: admin_remove", encode(AdminRemove{2, "cube"})},
      {"server, admin: admin_answer",
       encode(AdminAnswer{2, true, R"({"removed":"cube","generation":"1122334455667788"})"})},
  };
}

/// The fifth one.
Frames rule_example() {
  const std::string answer = R"({"client":7,"weight":2.5,"before":1})";
  return {
      {"client, admin: admin_set_rule",
       encode(AdminSetRule{1, {true, {}}, "fcsf", {{"burst", "2"}, {"slots", "auto"}}})},
      {"client, admin: admin_set_rule", encode(AdminSetRule{2, {false, 3}, "gain", {}})},
      {"server, admin: error", encode(ErrorMessage{2, ErrorCode::version_changed, "the rule has version 4 by now"})},
      {"client, admin: admin_revert", encode(AdminRevert{3, {}, 0})},
      {"client, admin: admin_history", encode(AdminHistory{4, 10})},
      {"client, admin: admin_weight", encode(AdminWeight{5, 7, 2500})},
      {"server, admin: admin_answer", encode(AdminAnswer{5, true, answer})},
      {"client, admin: admin_explain", encode(AdminExplain{6, 9})},
      {"server, admin: error", encode(ErrorMessage{6, ErrorCode::unknown_client, "there is no session 9"})},
  };
}

/// The frames of the n-th fenced block below the heading of the examples.
Frames documented_example(int n) {
  Frames frames;
  bool below = false;
  bool fenced = false;
  int block = 0;
  for (const std::string& line : document_lines()) {
    if (line.rfind("## ", 0) == 0) below = line == "## Worked examples";
    if (!below) continue;
    if (line.rfind("```", 0) == 0) {
      fenced = !fenced;
      if (fenced) ++block;
    } else if (!fenced || block != n) {
      continue;
    } else if (line.rfind("# ", 0) == 0) {
      frames.emplace_back(line.substr(2), Bytes{});
    } else if (!frames.empty()) {
      const Bytes more = testing::from_hex(line);
      frames.back().second.insert(frames.back().second.end(), more.begin(), more.end());
    }
  }
  return frames;
}

void expect_same(const Frames& documented, const Frames& expected) {
  ASSERT_EQ(documented.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(documented[i].first, expected[i].first) << "frame " << i;
    EXPECT_EQ(testing::to_hex(documented[i].second), testing::to_hex(expected[i].second)) << expected[i].first;
  }
}

TEST(Document, WorkedExamples) {
  expect_same(documented_example(1), fetch_example());
  expect_same(documented_example(2), resume_example());
  expect_same(documented_example(3), version_example());
  expect_same(documented_example(4), ingest_example());
  expect_same(documented_example(5), rule_example());
  EXPECT_TRUE(documented_example(6).empty()) << "an example that nothing checks";
}

}  // namespace
}  // namespace pmcd::proto
