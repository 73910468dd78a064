// SPDX-License-Identifier: MIT
// The admin socket: its file, its commands, and what an ingest may not do.
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/daemon/raw_client.h"
#include "tests/daemon/server_in_thread.h"

namespace pmcd::test {
namespace {

using nlohmann::json;
using proto::encode;

TEST(Admin, HelloAndRefusals) {
  ServerInThread server;
  auto admin = RawAdmin::open(server.admin_socket());
  ASSERT_NE(admin.connection.fd(), -1);
  EXPECT_EQ(admin.answer(proto::make_frame(static_cast<proto::FrameType>(0x6000), {})), "error: unknown_type");
  admin.connection.send(encode(proto::Ping{9}));
  EXPECT_EQ(expect<proto::Pong>(admin.connection).id, 9U);
  EXPECT_EQ(admin.answer(encode(proto::GetMeshList{1})), "error: wrong_state");
  EXPECT_TRUE(admin.connection.closes());
  for (const proto::Bytes& first : {encode(proto::Hello{{}, "x"}), encode(proto::AdminList{1})}) {
    auto other = RawConnection::local(server.admin_socket());
    other.send(first);
    EXPECT_EQ(expect_error(other, 0), "wrong_state");
    EXPECT_TRUE(other.closes());
  }
}

TEST(Admin, ListShowRemoveStatus) {
  ServerInThread server({}, 3);
  auto admin = RawAdmin::open(server.admin_socket());
  EXPECT_EQ(json::parse(admin.answer(encode(proto::AdminList{1}))),
            (json{{"meshes", json::array()}, {"damaged", json::array()}}));
  const FakeMesh mesh = fake_mesh(1, {100, 2000, 30});
  ASSERT_EQ(admin.ingest("m", mesh), "ok");
  const json list = json::parse(admin.answer(encode(proto::AdminList{2})));
  ASSERT_EQ(list["meshes"].size(), 1U);
  const json show = json::parse(admin.answer(encode(proto::AdminShow{3, "m"})));
  for (const auto& [key, value] : list["meshes"][0].items()) EXPECT_EQ(show[key], value) << key;
  std::array<char, 17> generation{};
  std::snprintf(generation.data(), generation.size(), "%016lx", static_cast<unsigned long>(mesh.directory.generation));
  EXPECT_EQ(show["name"], "m");
  EXPECT_EQ(show["generation"], generation.data());
  EXPECT_EQ(show["vertices"], mesh.directory.levels[2].vertices);
  EXPECT_EQ(show["faces"], mesh.directory.levels[2].faces);
  EXPECT_EQ(show["packets"], 3);
  EXPECT_EQ(show["bytes"], mesh.packets[0].size() + mesh.packets[1].size() + mesh.packets[2].size());
  EXPECT_EQ(show["lossless"], false);
  EXPECT_EQ(show["bits"], 14);
  EXPECT_EQ(show["scalar"], "float64");
  EXPECT_EQ(show["format_version"], 0);
  EXPECT_EQ(show["box_min"], (json{-1.5, 0.25, 3.0}));
  EXPECT_EQ(show["box_max"], (json{2.5, 1.75, 4.125}));
  EXPECT_EQ(show["ingested_at"].get<std::string>().size(), 20U);
  ASSERT_EQ(show["levels"].size(), 3U);
  EXPECT_EQ(show["levels"][0]["error_rms"], 0.5);
  EXPECT_EQ(show["levels"][1]["error_rms"], nullptr);
  EXPECT_EQ(show["levels"][1]["bytes"], mesh.packets[1].size());
  EXPECT_EQ(show["levels"][1]["crc32c"].get<std::string>().size(), 8U);

  const json status = json::parse(admin.answer(encode(proto::AdminStatus{4})));
  EXPECT_EQ(status["rule"], "fifo");
  EXPECT_EQ(status["slots"], 3);
  EXPECT_EQ(status["meshes"], 1);
  EXPECT_EQ(status["sessions"], 0);
  EXPECT_EQ(status["session_limit"], 9'000);
  EXPECT_EQ(status["cache_limit_bytes"], 64 << 20);
  EXPECT_EQ(status["cache_bytes"], 0);
  EXPECT_EQ(status["cache_hits"], 0);
  EXPECT_EQ(status["cache_misses"], 0);
  EXPECT_EQ(status["request_port"], server.request_port());
  EXPECT_EQ(status["data_port"], server.data_port());
  EXPECT_EQ(status["protocol"], "1.0");

  EXPECT_EQ(admin.answer(encode(proto::AdminShow{5, "x"})), "error: unknown_mesh");
  EXPECT_EQ(admin.answer(encode(proto::AdminRemove{6, "x"})), "error: unknown_mesh");
  EXPECT_EQ(json::parse(admin.answer(encode(proto::AdminRemove{7, "m"}))),
            (json{{"removed", "m"}, {"generation", generation.data()}}));
  EXPECT_EQ(admin.answer(encode(proto::AdminShow{8, "m"})), "error: unknown_mesh");
}

TEST(Admin, LongListsComeInPieces) {
  ServerInThread server;
  auto admin = RawAdmin::open(server.admin_socket());
  const FakeMesh mesh = fake_mesh(1, std::vector<std::size_t>(1'000, 0));
  for (int i = 0; i < 3; ++i) ASSERT_EQ(admin.ingest("m" + std::to_string(i), mesh), "ok");
  const std::string text = admin.answer(encode(proto::AdminShow{1, "m1"}));
  EXPECT_GT(text.size(), 100'000U);
  EXPECT_EQ(json::parse(text)["levels"].size(), 1'000U);
}

TEST(Admin, IngestErrorsByName) {
  ServerInThread server({}, 1, store::UploadLimits{100'000, 100'000});
  auto admin = RawAdmin::open(server.admin_socket());
  const FakeMesh mesh = fake_mesh(2, {100, 200});
  ASSERT_EQ(admin.ingest("m", mesh), "ok");
  EXPECT_EQ(admin.ingest("m", mesh), "mesh_exists");
  EXPECT_EQ(admin.ingest("m", mesh, true), "replaced");
  EXPECT_EQ(admin.ingest("a/b", mesh), "bad_name");
  EXPECT_EQ(admin.ingest("big", fake_mesh(3, {100'000})), "too_large");
  FakeMesh flipped = mesh;
  flipped.packets[1].back() ^= std::byte{1};
  EXPECT_EQ(admin.ingest("f", flipped), "bad_packet");
  FakeMesh longer = mesh;
  longer.packets[0].push_back(std::byte{0});
  EXPECT_EQ(admin.ingest("l", longer), "bad_packet");
  FakeMesh shorter = mesh;
  shorter.packets.pop_back();
  EXPECT_EQ(admin.ingest("s", shorter), "ingest_incomplete");
  FakeMesh cut = mesh;
  cut.packets[0].pop_back();
  EXPECT_EQ(admin.ingest("c", cut), "ingest_incomplete");
  admin.connection.send(encode(proto::IngestBegin{1, false, "d", proto::Bytes(10, std::byte{1})}));
  EXPECT_EQ(expect_error(admin.connection, 1), "bad_directory");
  const json list = json::parse(admin.answer(encode(proto::AdminList{2})));
  ASSERT_EQ(list["meshes"].size(), 1U) << "nothing of the refused meshes is there";
  EXPECT_EQ(admin.ingest("n", mesh, false, 1), "ok") << "the connection took no harm, and bytes may come one by one";
}

TEST(Admin, IngestOutOfTurnEndsTheConnection) {
  ServerInThread server;
  const FakeMesh mesh = fake_mesh(4, {100});
  auto none = RawAdmin::open(server.admin_socket());
  none.connection.send(encode(proto::IngestCommit{1}));
  EXPECT_EQ(expect_error(none.connection, 0), "wrong_state");
  EXPECT_TRUE(none.connection.closes());
  auto twice = RawAdmin::open(server.admin_socket());
  twice.connection.send(encode(proto::IngestBegin{1, false, "m", mesh.directory_bytes()}));
  expect<proto::IngestReady>(twice.connection);
  twice.connection.send(encode(proto::IngestBegin{2, false, "n", mesh.directory_bytes()}));
  EXPECT_EQ(expect_error(twice.connection, 0), "wrong_state");
  EXPECT_TRUE(twice.connection.closes());
}

TEST(Admin, UploadThatBreaksOffLeavesNothingAndGivesItsRoomBack) {
  ServerInThread server({}, 1, store::UploadLimits{100'000, 100'000});
  const FakeMesh mesh = fake_mesh(5, {90'000});
  {
    auto admin = RawAdmin::open(server.admin_socket());
    admin.connection.send(encode(proto::IngestBegin{1, false, "m", mesh.directory_bytes()}));
    expect<proto::IngestReady>(admin.connection);
    EXPECT_EQ(RawAdmin::open(server.admin_socket()).ingest("n", mesh), "too_large");
  }
  std::string result;
  for (int i = 0; i < 200 && result != "ok"; ++i) {
    result = RawAdmin::open(server.admin_socket()).ingest("n", mesh);
    if (result != "ok") std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_EQ(result, "ok");
  const json list = json::parse(RawAdmin::open(server.admin_socket()).answer(encode(proto::AdminList{2})));
  ASSERT_EQ(list["meshes"].size(), 1U);
  EXPECT_EQ(list["meshes"][0]["name"], "n");
}

TEST(Admin, ManyIngestsAtOnce) {
  ServerInThread server;
  std::vector<std::thread> operators;
  for (int i = 0; i < 16; ++i) {
    operators.emplace_back([&server, i] {
      const FakeMesh mesh = fake_mesh(static_cast<std::uint64_t>(i), {1'000, 50'000});
      EXPECT_EQ(RawAdmin::open(server.admin_socket()).ingest("m" + std::to_string(i), mesh), "ok");
    });
  }
  for (std::thread& one : operators) one.join();
  for (int i = 0; i < 16; ++i) {
    auto session = RawSession::open(server.request_port());
    EXPECT_EQ(session.fetch("m" + std::to_string(i)),
              fake_mesh(static_cast<std::uint64_t>(i), {1'000, 50'000}).packets);
  }
}

TEST(AdminSocket, IsForOwnerAndGroupOnly) {
  ServerInThread server;
  struct stat status {};
  ASSERT_EQ(::stat(server.admin_socket().c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0660U);
}

class ListenUnixTest : public ::testing::Test {
 protected:
  /// "listening", or the error.
  std::string listen() {
    auto result = net::listen_unix(io_.get_executor(), path_);
    if (const auto* error = std::get_if<net::ListenError>(&result)) return error->text;
    return "listening";
  }

  TemporaryFolder folder_;
  std::string path_ = folder_.file("admin.sock");
  net::asio::io_context io_{1};
};

TEST_F(ListenUnixTest, ReplacesASocketOnWhichNobodyAnswers) {
  EXPECT_EQ(listen(), "listening");  // closed at once, and the file stays: as after kill -9
  ASSERT_EQ(::access(path_.c_str(), F_OK), 0);
  EXPECT_EQ(listen(), "listening");
}

TEST_F(ListenUnixTest, LeavesASocketThatAnswersAlone) {
  const auto first = net::listen_unix(io_.get_executor(), path_);
  ASSERT_TRUE(std::holds_alternative<net::UnixAcceptor>(first));
  EXPECT_EQ(listen(), "another program answers on " + path_ + "; is a pmcd running already?");
  EXPECT_NE(RawConnection::local(path_).fd(), -1);
}

TEST_F(ListenUnixTest, NeverReplacesAFile) {
  std::ofstream(path_) << "precious";
  EXPECT_EQ(listen(), path_ + " exists and is not a socket");
  std::string content;
  std::ifstream(path_) >> content;
  EXPECT_EQ(content, "precious");
}

TEST_F(ListenUnixTest, RefusesPathsThatDoNotFit) {
  path_ = std::string(108, 'x');
  EXPECT_NE(listen().find("1 to 107 bytes"), std::string::npos);
}

}  // namespace
}  // namespace pmcd::test
