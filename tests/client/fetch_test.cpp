// SPDX-License-Identifier: MIT
// A fetch that is resumed, paused, stopped and refused: what is asked for, the pauses, and when it ends.
#include "client/fetch.h"

#include <gtest/gtest.h>

#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "tests/client/mock_server.h"
#include "tests/client/recorded_fetch.h"

namespace pmcd::client {
namespace {

using namespace std::chrono_literals;
using proto::ErrorCode;
using proto::TransferEnd;
using proto::TransferResult;
using testing::kMesh;
using testing::mock_mesh;
using testing::MockMesh;
using testing::MockServer;
using testing::Recorded;
using testing::size_of;
using Clock = std::chrono::steady_clock;

/// What a server answers to the question whether "m" is still that generation.
void serve_name(MockServer::Peer& peer, std::uint64_t generation) {
  proto::MeshListEntry other;
  other.name = "M";
  proto::MeshListEntry entry;
  entry.name = "m";
  entry.generation = generation;
  const proto::Bytes page = proto::encode_mesh_page({2, 0, {other, entry}});
  const auto request = peer.request.expect<proto::GetMeshList>();
  if (request.filter != "m") throw std::runtime_error("the client looks for another mesh");
  peer.data.send_chunk({request.id, 0, 0, 0, page.size()}, page);
  peer.data.send(TransferEnd{request.id, TransferResult::complete, ErrorCode::none});
}

TEST(Fetch, AWholePacketWithoutItsEndIsNotAskedForAgain) {
  MockServer server([&](MockServer& s) {
    {
      auto peer = s.accept_session();
      MockServer::serve_base(peer, kMesh);
      MockServer::send_part(peer, peer.request.expect<proto::GetNextPacket>().id, kMesh, 1, 0, kMesh.packets[1].size());
    }
    auto peer = s.accept_session();
    MockServer::serve_rest(peer, kMesh, 2, 0);
  });
  Recorded fetch;
  const auto summary = fetch.run(server);
  EXPECT_EQ(server.finish(), "");
  ASSERT_TRUE(summary.ok()) << summary.error().text;
  EXPECT_EQ(fetch.levels, kMesh.packets);
  EXPECT_EQ(summary->bytes_received, size_of(kMesh.packets));
}

TEST(Fetch, BytesThatCameBeforeTheAnswerAreNotAskedForAgain) {
  MockServer server([&](MockServer& s) {
    {
      auto peer = s.accept_session();
      MockServer::serve_base(peer, kMesh);
    }
    {
      auto peer = s.accept_session();
      MockServer::send_part(peer, MockServer::expect_get_packet(peer, kMesh, 1, 0), kMesh, 1, 0, 77);
    }
    auto peer = s.accept_session();
    MockServer::serve_rest(peer, kMesh, 1, 77);
    MockServer::serve_next(peer, kMesh, 2);
  });
  Recorded fetch;
  const auto summary = fetch.run(server);
  EXPECT_EQ(server.finish(), "");
  ASSERT_TRUE(summary.ok()) << summary.error().text;
  EXPECT_EQ(fetch.levels, kMesh.packets);
  EXPECT_EQ(fetch.told, size_of(kMesh.packets));
}

TEST(Fetch, PausesGrowAndBytesBeginThemAnew) {
  MockServer server([&](MockServer& s) {
    for (int i = 0; i < 2; ++i) s.accept_request();
    {
      auto peer = s.accept_session();
      MockServer::serve_base(peer, kMesh);
    }
    for (int i = 0; i < 3; ++i) s.accept_request();
  });
  Recorded fetch;
  fetch.options.retry.first_pause = 20ms;
  fetch.options.retry.longest_pause = 50ms;
  const auto before = Clock::now();
  const auto summary = fetch.run(server);
  ASSERT_FALSE(summary.ok());
  EXPECT_EQ(summary.error().failure, Failure::lost);
  EXPECT_NE(summary.error().text.find("gave up after 4 tries: "), std::string::npos) << summary.error().text;
  std::vector<std::int64_t> pauses;
  for (const RetryNotice& retry : fetch.retries) pauses.push_back(retry.pause.count());
  EXPECT_EQ(pauses, (std::vector<std::int64_t>{20, 40, 20, 40, 50}));
  EXPECT_GE(Clock::now() - before, 170ms) << "they are waited for";
  EXPECT_EQ(fetch.state.packets_done, 1u);
  EXPECT_EQ(fetch.state.directory_bytes, kMesh.directory);
}

TEST(Fetch, WhatIsFinalIsNotTriedAgain) {
  struct Case {
    const char* name;
    std::function<void(MockServer::Peer& peer, std::uint32_t id)> answer;
    Failure failure;
    ErrorCode code;
  };
  const std::vector<Case> cases{
      {"unknown mesh",
       [](auto& peer, auto id) {
         peer.request.send(proto::ErrorMessage{id, ErrorCode::unknown_mesh, ""});
       },
       Failure::refused, ErrorCode::unknown_mesh},
      {"unavailable",
       [](auto& peer, auto id) {
         peer.request.send(proto::MeshOpened{id, 1, kMesh.generation, kMesh.directory});
         peer.data.send(TransferEnd{id, TransferResult::failed, ErrorCode::unavailable});
       },
       Failure::refused, ErrorCode::unavailable},
      {"mesh changed",
       [](auto& peer, auto id) {
         peer.request.send(proto::ErrorMessage{id, ErrorCode::mesh_changed, ""});
       },
       Failure::refused, ErrorCode::mesh_changed},
      {"violation",
       [](auto& peer, auto id) {
         peer.request.send(TransferEnd{id, TransferResult::complete, ErrorCode::none});
       },
       Failure::violation, ErrorCode::none},
      {"damaged in one piece",
       [](auto& peer, auto id) {
         MockMesh bad = kMesh;
         bad.packets[0].back() ^= std::byte{1};
         peer.request.send(proto::MeshOpened{id, 1, kMesh.generation, kMesh.directory});
         MockServer::send_packet(peer, id, bad, 0);
       },
       Failure::damaged, ErrorCode::none},
  };
  for (const Case& one : cases) {
    MockServer server([&](MockServer& s) {
      auto peer = s.accept_session();
      one.answer(peer, peer.request.expect<proto::GetBaseMesh>().id);
      peer.data.closed();
    });
    Recorded fetch;
    fetch.options.begin_again_if_changed = true;
    const auto summary = fetch.run(server);
    ASSERT_FALSE(summary.ok()) << one.name;
    EXPECT_EQ(summary.error().failure, one.failure) << one.name << ": " << summary.error().text;
    EXPECT_EQ(summary.error().code, one.code) << one.name;
    EXPECT_TRUE(fetch.retries.empty()) << one.name;
    EXPECT_EQ(fetch.restarts, 0) << one.name;
  }
}

TEST(Fetch, AServerThatNeverCouldBeReachedIsToldAtOnce) {
  std::uint16_t port = 0;
  { port = testing::Socket::listen().port(); }
  Recorded fetch;
  const auto summary = fetch.run(Address{"127.0.0.1", port});
  ASSERT_FALSE(summary.ok());
  EXPECT_EQ(summary.error().failure, Failure::cannot_reach);
  EXPECT_TRUE(fetch.retries.empty());
}

TEST(Fetch, AStateIsUsedIfTheNameStillMeansIt) {
  MockServer server([&](MockServer& s) {
    auto peer = s.accept_session();
    serve_name(peer, kMesh.generation);
    MockServer::serve_rest(peer, kMesh, 1, 7);
    MockServer::serve_next(peer, kMesh, 2);
  });
  Recorded fetch;
  fetch.state = {kMesh.generation, kMesh.directory, 1, {kMesh.packets[1].begin(), kMesh.packets[1].begin() + 7}};
  const auto summary = fetch.run(server);
  EXPECT_EQ(server.finish(), "");
  ASSERT_TRUE(summary.ok()) << summary.error().text;
  EXPECT_EQ(fetch.levels, (std::vector{kMesh.packets[1], kMesh.packets[2]}));
  EXPECT_EQ(fetch.directories.size(), 1u);
  EXPECT_EQ(summary->bytes_received, kMesh.packets[1].size() - 7 + kMesh.packets[2].size());
}

TEST(Fetch, AStateThatIsCompleteAsksNobody) {
  Recorded fetch;
  fetch.state = {kMesh.generation, kMesh.directory, 2, {}};
  fetch.options.last_level = 1;
  EXPECT_TRUE(fetch.run(Address{"127.0.0.1", 1}).ok());
  EXPECT_TRUE(fetch.levels.empty());
}

/// By the name's generation in the list, by the server's answer to get_packet, or in the middle of a session.
TEST(Fetch, AMeshThatChangedIsAnErrorOrABeginning) {
  const MockMesh old = mock_mesh({10, 20});
  for (const bool begin_again : {false, true}) {
    for (const int told_by : {0, 1, 2}) {
      MockServer server([&](MockServer& s) {
        auto peer = s.accept_session();
        serve_name(peer, told_by == 0 ? old.generation + 1 : old.generation);
        if (told_by == 1) {
          const auto id = MockServer::expect_get_packet(peer, old, 1, 3);
          peer.request.send(proto::ErrorMessage{id, ErrorCode::mesh_changed, ""});
        }
        if (told_by == 2) {
          const auto id = MockServer::expect_get_packet(peer, old, 1, 3);
          peer.request.send(proto::MeshOpened{id, 1, old.generation, old.directory});
          peer.data.send(TransferEnd{id, TransferResult::failed, ErrorCode::mesh_changed});
        }
        if (!begin_again) return;
        auto again = s.accept_session();
        MockServer::serve_base(again, kMesh);
        for (std::uint32_t k = 1; k < 3; ++k) MockServer::serve_next(again, kMesh, k);
      });
      Recorded fetch;
      fetch.options.begin_again_if_changed = begin_again;
      fetch.state = {old.generation, old.directory, 1, {old.packets[1].begin(), old.packets[1].begin() + 3}};
      const auto summary = fetch.run(server);
      EXPECT_EQ(server.finish(), "") << told_by;
      EXPECT_EQ(fetch.restarts, begin_again ? 1 : 0);
      EXPECT_TRUE(fetch.retries.empty());
      if (begin_again) {
        ASSERT_TRUE(summary.ok()) << summary.error().text;
        EXPECT_EQ(fetch.levels, kMesh.packets);
        EXPECT_EQ(fetch.directories, (std::vector{old.directory, kMesh.directory}));
      } else {
        ASSERT_FALSE(summary.ok());
        EXPECT_EQ(summary.error().code, ErrorCode::mesh_changed);
        EXPECT_EQ(fetch.state.packets_done, 1u) << "what is there stays";
      }
    }
  }
}

TEST(Fetch, ADamagedBeginningIsFetchedAgain) {
  MockServer server([&](MockServer& s) {
    {
      auto peer = s.accept_session();
      serve_name(peer, kMesh.generation);
      MockServer::serve_rest(peer, kMesh, 1, 100);
      peer.data.closed();
    }
    auto peer = s.accept_session();
    MockServer::serve_rest(peer, kMesh, 1, 0);
    MockServer::serve_next(peer, kMesh, 2);
  });
  Recorded fetch;
  fetch.state = {kMesh.generation, kMesh.directory, 1, proto::Bytes(100, std::byte{9})};
  const auto summary = fetch.run(server);
  EXPECT_EQ(server.finish(), "");
  ASSERT_TRUE(summary.ok()) << summary.error().text;
  EXPECT_EQ(fetch.levels, (std::vector{kMesh.packets[1], kMesh.packets[2]}));
  ASSERT_EQ(fetch.retries.size(), 1u);
  EXPECT_EQ(fetch.retries[0].error.failure, Failure::damaged);
}

TEST(Fetch, StatesThatContradictThemselvesAreRefused) {
  proto::Bytes cut = kMesh.directory;
  cut.pop_back();
  for (const FetchState& bad : std::vector<FetchState>{
           {kMesh.generation, cut, 0, {}},
           {kMesh.generation + 1, kMesh.directory, 0, {}},
           {kMesh.generation, kMesh.directory, 4, {}},
           {kMesh.generation, kMesh.directory, 3, proto::Bytes(1)},
           {kMesh.generation, kMesh.directory, 2, kMesh.packets[2]},
       }) {
    Recorded fetch;
    fetch.state = bad;
    const auto summary = fetch.run(Address{"127.0.0.1", 1});
    ASSERT_FALSE(summary.ok());
    EXPECT_STREQ(failure_name(summary.error().failure), "bad_state") << summary.error().text;
  }
}

TEST(Fetch, OnlyTheLevelsThatAreWanted) {
  MockServer server([&](MockServer& s) {
    auto peer = s.accept_session();
    MockServer::serve_base(peer, kMesh);
    MockServer::serve_next(peer, kMesh, 1);
    peer.request.expect<proto::Goodbye>();
  });
  Recorded fetch;
  fetch.options.last_level = 1;
  const auto summary = fetch.run(server);
  EXPECT_EQ(server.finish(), "");
  ASSERT_TRUE(summary.ok());
  EXPECT_EQ(fetch.levels.size(), 2u);

  MockServer other([&](MockServer& s) {
    auto peer = s.accept_session();
    MockServer::serve_base(peer, kMesh);
  });
  Recorded beyond;
  beyond.options.last_level = 3;
  const auto refused = beyond.run(other);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().failure, Failure::no_such_level);
  EXPECT_NE(refused.error().text.find("the levels 0 to 2, not 3"), std::string::npos) << refused.error().text;
}

TEST(Fetch, CallbacksEndItAndItGoesOnLater) {
  MockServer server([&](MockServer& s) {
    {
      auto peer = s.accept_session();
      MockServer::serve_base(peer, kMesh);
      const auto id = peer.request.expect<proto::GetNextPacket>().id;
      MockServer::send_part(peer, id, kMesh, 1, 0, 100);
      peer.request.expect<proto::Cancel>();
      peer.data.send(TransferEnd{id, TransferResult::cancelled, ErrorCode::none});
    }
    {
      auto peer = s.accept_session();
      serve_name(peer, kMesh.generation);
      MockServer::serve_rest(peer, kMesh, 1, 100);
    }
    auto peer = s.accept_session();
    serve_name(peer, kMesh.generation);
    MockServer::serve_rest(peer, kMesh, 2, 0);
  });
  Recorded fetch;
  const auto count = fetch.callbacks.on_level;
  fetch.callbacks.on_progress = [](const Progress& progress) { return progress.packet == 0; };
  EXPECT_EQ(fetch.run(server).error().failure, Failure::cancelled);
  EXPECT_EQ(fetch.state.packets_done, 1u);
  EXPECT_EQ(fetch.state.partial.size(), 100u);
  fetch.callbacks.on_progress = {};
  fetch.callbacks.on_level = [&](const FetchedLevel& level) { return count(level) && level.level != 1; };
  EXPECT_EQ(fetch.run(server).error().failure, Failure::cancelled);
  EXPECT_EQ(fetch.state.packets_done, 2u);
  EXPECT_TRUE(fetch.run(server).ok());
  EXPECT_EQ(server.finish(), "");
  EXPECT_EQ(fetch.levels, kMesh.packets);
}

TEST(Fetch, AStopEndsAPause) {
  MockServer server([&](MockServer& s) { s.accept_request(); });
  std::stop_source source;
  Recorded fetch;
  fetch.options.retry.first_pause = 60s;
  fetch.options.retry.longest_pause = 60s;
  fetch.options.session.stop = source.get_token();
  fetch.callbacks.on_retry = [&](const RetryNotice&) { source.request_stop(); };
  const auto before = Clock::now();
  EXPECT_EQ(fetch.run(server).error().failure, Failure::cancelled);
  EXPECT_LT(Clock::now() - before, 10s);
}

}  // namespace
}  // namespace pmcd::client
