// SPDX-License-Identifier: MIT
// A fetch goes on by itself: lines lost at every point, and what is asked for afterwards.
#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "client/fetch.h"
#include "tests/client/mock_server.h"
#include "tests/client/recorded_fetch.h"

namespace pmcd::client {
namespace {

using namespace std::chrono_literals;
using proto::ErrorCode;
using testing::kMesh;
using testing::Line;
using testing::MockServer;
using testing::Recorded;
using testing::size_of;
using Clock = std::chrono::steady_clock;

struct Loss {
  const char* name;
  std::function<void(MockServer& server)> lose;
  bool has_directory;  ///< then the client goes on with get_packet for ...
  std::uint32_t packet = 0;
  std::uint64_t offset = 0;
};

class LostLine : public ::testing::TestWithParam<Loss> {};

/// Lost in the same way twice, then served to the end: nothing is asked for twice.
TEST_P(LostLine, IsFoundAgain) {
  const Loss& loss = GetParam();
  MockServer server([&](MockServer& s) {
    loss.lose(s);
    auto peer = s.accept_session();
    std::uint32_t next = 1;
    if (loss.has_directory) {
      MockServer::serve_rest(peer, kMesh, loss.packet, loss.offset);
      next = loss.packet + 1;
    } else {
      MockServer::serve_base(peer, kMesh);
    }
    for (; next < 3; ++next) MockServer::serve_next(peer, kMesh, next);
    peer.request.expect<proto::Goodbye>();
  });
  Recorded fetch;
  const auto before = Clock::now();
  const auto summary = fetch.run(server);
  EXPECT_EQ(server.finish(), "");
  ASSERT_TRUE(summary.ok()) << summary.error().text;
  EXPECT_EQ(fetch.levels, kMesh.packets);
  EXPECT_EQ(fetch.directories, std::vector<proto::Bytes>{kMesh.directory}) << "told once";
  EXPECT_EQ(summary->levels, 3u);
  EXPECT_EQ(summary->retries, 1u);
  EXPECT_EQ(summary->bytes_received, size_of(kMesh.packets)) << "no byte came twice";
  EXPECT_EQ(fetch.told, size_of(kMesh.packets));
  ASSERT_EQ(fetch.retries.size(), 1u);
  EXPECT_EQ(fetch.retries[0].pause, 2ms);
  EXPECT_EQ(fetch.retries[0].tries, 1u);
  EXPECT_GE(Clock::now() - before, 2ms);
  EXPECT_EQ(fetch.state.packets_done, 3u);
  EXPECT_TRUE(fetch.state.partial.empty());
}

Loss cut_at(const char* name, std::size_t byte) {
  return {name,
          [byte](MockServer& s) {
            auto peer = s.accept_session();
            MockServer::serve_base(peer, kMesh);
            MockServer::send_part(peer, peer.request.expect<proto::GetNextPacket>().id, kMesh, 1, 0, byte);
          },
          true, 1, byte};
}

const std::vector<Loss> all_losses{
    {"while_connecting", [](MockServer& s) { s.accept_request(); }, false},
    {"behind_hello", [](MockServer& s) { s.accept_request().expect<proto::Hello>(); }, false},
    {"too_many_sessions",
     [](MockServer& s) {
       Line line = s.accept_request();
       line.expect<proto::Hello>();
       line.send(proto::ErrorMessage{0, ErrorCode::too_many_sessions, ""});
     },
     false},
    {"token_of_another_life",
     [](MockServer& s) {
       Line line = s.accept_request();
       line.expect<proto::Hello>();
       proto::HelloOk ok;
       ok.data_port = s.data_port();
       line.send(ok);
       Line data = s.accept_data();
       data.expect<proto::Join>();
       data.send(proto::ErrorMessage{0, ErrorCode::bad_token, ""});
     },
     false},
    {"behind_join", [](MockServer& s) { s.accept_session(); }, false},
    {"before_the_directory", [](MockServer& s) { s.accept_session().request.expect<proto::GetBaseMesh>(); }, false},
    {"behind_the_directory",
     [](MockServer& s) {
       auto peer = s.accept_session();
       const auto id = peer.request.expect<proto::GetBaseMesh>().id;
       peer.request.send(proto::MeshOpened{id, 1, kMesh.generation, kMesh.directory});
     },
     true, 0, 0},
    {"within_the_base",
     [](MockServer& s) {
       auto peer = s.accept_session();
       const auto id = peer.request.expect<proto::GetBaseMesh>().id;
       peer.request.send(proto::MeshOpened{id, 1, kMesh.generation, kMesh.directory});
       MockServer::send_part(peer, id, kMesh, 0, 0, 17);
     },
     true, 0, 17},
    cut_at("at_byte_1", 1),
    cut_at("at_byte_100", 100),
    cut_at("at_byte_499", 499),
    {"all_bytes_but_no_end",
     [](MockServer& s) {
       auto peer = s.accept_session();
       MockServer::serve_base(peer, kMesh);
       MockServer::send_part(peer, peer.request.expect<proto::GetNextPacket>().id, kMesh, 1, 0, 499);
       peer.data.close();
     },
     true, 1, 499},
    {"between_packets",
     [](MockServer& s) {
       auto peer = s.accept_session();
       MockServer::serve_base(peer, kMesh);
       MockServer::serve_next(peer, kMesh, 1);
     },
     true, 2, 0},
    {"shutting_down_overtakes_bytes",
     [](MockServer& s) {
       auto peer = s.accept_session();
       MockServer::serve_base(peer, kMesh);
       const auto id = peer.request.expect<proto::GetNextPacket>().id;
       MockServer::send_part(peer, id, kMesh, 1, 0, 100);
       peer.request.send(proto::ErrorMessage{0, ErrorCode::shutting_down, ""});
       peer.request.closed();  // the client has read it
       MockServer::send_part(peer, id, kMesh, 1, 100, 250);
     },
     true, 1, 250},
};

INSTANTIATE_TEST_SUITE_P(All, LostLine, ::testing::ValuesIn(all_losses),
                         [](const auto& loss) { return std::string(loss.param.name); });

}  // namespace
}  // namespace pmcd::client
