// SPDX-License-Identifier: MIT
// The client against a scripted server: the right way through, refusals, lost lines and time-outs.
#include "client/session.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/client/mock_server.h"

namespace pmcd::client {
namespace {

using namespace std::chrono_literals;
using proto::ErrorCode;
using proto::TransferEnd;
using proto::TransferResult;
using testing::first_error;
using testing::Line;
using testing::mock_mesh;
using testing::MockMesh;
using testing::MockServer;
using testing::quick;

TEST(Session, FetchesAMeshPacketByPacket) {
  const MockMesh mesh = mock_mesh({10, 250, 0, 1000});
  MockServer server([&](MockServer& s) {
    auto peer = s.accept_session();
    MockServer::serve_base(peer, mesh);
    for (std::uint32_t k = 1; k < 4; ++k) MockServer::serve_next(peer, mesh, k);
    for (int i = 0; i < 2; ++i) {
      const auto id = peer.request.expect<proto::GetNextPacket>().id;
      peer.data.send(TransferEnd{id, TransferResult::end_of_mesh, ErrorCode::none});
    }
    peer.request.expect<proto::Goodbye>();
  });
  {
    auto session = Session::connect(server.address(), quick());
    ASSERT_TRUE(session.ok()) << session.error().text;
    EXPECT_EQ(session->server_agent(), "mock");
    const auto opened = session->open("m");
    ASSERT_TRUE(opened.ok()) << opened.error().text;
    EXPECT_EQ(opened->generation, mesh.generation);
    EXPECT_EQ(opened->directory.levels.size(), 4u);
    EXPECT_EQ(opened->directory_bytes, mesh.directory);
    for (std::uint32_t k = 0; k < 4; ++k) {
      std::vector<std::uint64_t> seen;
      const auto packet = session->next_packet(opened->handle, [&](const Progress& progress) {
        EXPECT_EQ(progress.packet, k);
        EXPECT_EQ(progress.total, mesh.packets[k].size());
        seen.push_back(progress.received);
        return true;
      });
      ASSERT_TRUE(packet.ok()) << packet.error().text;
      ASSERT_TRUE(packet->has_value());
      EXPECT_EQ((*packet)->number, k);
      EXPECT_EQ((*packet)->bytes, mesh.packets[k]);
      ASSERT_FALSE(seen.empty());
      EXPECT_EQ(seen.back(), mesh.packets[k].size());
    }
    for (int i = 0; i < 2; ++i) {
      const auto after = session->next_packet(opened->handle);
      ASSERT_TRUE(after.ok()) << after.error().text;
      EXPECT_FALSE(after->has_value());
    }
  }
  EXPECT_EQ(server.finish(), "");
}

TEST(Session, ListsMeshes) {
  proto::MeshListEntry entry;
  entry.name = "bunny";
  entry.vertices = 7;
  const proto::Bytes list = proto::encode_mesh_page({1, 0, {entry}});
  MockServer server([&](MockServer& s) {
    auto peer = s.accept_session();
    const auto id = peer.request.expect<proto::GetMeshList>().id;
    peer.data.send_chunk({id, 0, 0, 0, list.size()}, proto::ByteView(list).first(5));
    peer.data.send_chunk({id, 0, 0, 5, list.size()}, proto::ByteView(list).subspan(5));
    peer.data.send(TransferEnd{id, TransferResult::complete, ErrorCode::none});
  });
  auto session = Session::connect(server.address(), quick());
  ASSERT_TRUE(session.ok()) << session.error().text;
  const auto entries = session->list();
  ASSERT_TRUE(entries.ok()) << entries.error().text;
  EXPECT_EQ(*entries, std::vector{entry});
}

TEST(Session, TheBaseMayOvertakeItsDirectory) {
  const MockMesh mesh = mock_mesh({300});
  MockServer server([&](MockServer& s) {
    auto peer = s.accept_session();
    const auto id = peer.request.expect<proto::GetBaseMesh>().id;
    MockServer::send_packet(peer, id, mesh, 0);
    std::this_thread::sleep_for(100ms);
    peer.request.send(proto::MeshOpened{id, 1, mesh.generation, mesh.directory});
    peer.request.expect<proto::Goodbye>();
  });
  auto session = Session::connect(server.address(), quick());
  ASSERT_TRUE(session.ok());
  const auto opened = session->open("m");
  ASSERT_TRUE(opened.ok()) << opened.error().text;
  const auto packet = session->next_packet(opened->handle);
  ASSERT_TRUE(packet.ok()) << packet.error().text;
  EXPECT_EQ((*packet)->bytes, mesh.packets[0]);
}

TEST(Session, TwoMeshesAtOnce) {
  const MockMesh a = mock_mesh({300, 40});
  MockMesh b = mock_mesh({250, 60, 70});
  MockServer server([&](MockServer& s) {
    auto peer = s.accept_session();
    MockServer::serve_base(peer, a, 1);
    MockServer::serve_base(peer, b, 2);
    MockServer::serve_next(peer, b, 1, 2);
    MockServer::serve_next(peer, a, 1, 1);
    MockServer::serve_base(peer, a, 1);  // opened again: from the start
    MockServer::serve_next(peer, a, 1, 1);
  });
  auto session = Session::connect(server.address(), quick());
  ASSERT_TRUE(session.ok());
  const auto first = session->open("a");
  const auto second = session->open("b");
  ASSERT_TRUE(first.ok() && second.ok());
  const auto take = [&](std::uint32_t handle) {
    const auto packet = session->next_packet(handle);
    return packet.ok() && *packet ? (*packet)->bytes : proto::Bytes{};
  };
  EXPECT_EQ(take(2), b.packets[0]);
  EXPECT_EQ(take(2), b.packets[1]);
  EXPECT_EQ(take(1), a.packets[0]) << "collected although later requests ended before";
  EXPECT_EQ(take(1), a.packets[1]);
  ASSERT_TRUE(session->open("a").ok());
  EXPECT_EQ(take(1), a.packets[0]);
  EXPECT_EQ(take(1), a.packets[1]);
  EXPECT_EQ(server.finish(), "");
}

TEST(Session, NoMoreRequestsAreOpenThanTheServerAllows) {
  const MockMesh mesh = mock_mesh({300});
  bool early = false;
  MockServer server([&](MockServer& s) {
    auto peer = s.accept_session(1);
    const auto first = peer.request.expect<proto::GetBaseMesh>().id;
    peer.request.send(proto::MeshOpened{first, 1, mesh.generation, mesh.directory});
    early = peer.request.speaks_within(200ms);
    MockServer::send_packet(peer, first, mesh, 0);
    MockServer::serve_base(peer, mesh, 2);
  });
  auto session = Session::connect(server.address(), quick());
  ASSERT_TRUE(session.ok());
  const auto a = session->open("a");
  const auto b = session->open("b");
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_TRUE(session->next_packet(a->handle).ok());
  EXPECT_TRUE(session->next_packet(b->handle).ok());
  EXPECT_EQ(server.finish(), "");
  EXPECT_FALSE(early) << "the second request came while the first was open";
}

TEST(Session, ARefusalEndsTheRequestOnly) {
  const MockMesh mesh = mock_mesh({300, 50});
  MockServer server([&](MockServer& s) {
    auto peer = s.accept_session();
    const auto id = peer.request.expect<proto::GetBaseMesh>().id;
    peer.request.send(proto::ErrorMessage{id, ErrorCode::unknown_mesh, "there is no mesh \"x\""});
    MockServer::serve_base(peer, mesh);
    const auto next = peer.request.expect<proto::GetNextPacket>().id;
    peer.data.send_chunk({next, 1, 1, 0, mesh.packets[1].size()}, proto::ByteView(mesh.packets[1]).first(10));
    peer.data.send(TransferEnd{next, TransferResult::failed, ErrorCode::unavailable});
    MockServer::serve_next(peer, mesh, 1);
  });
  auto session = Session::connect(server.address(), quick());
  ASSERT_TRUE(session.ok());
  const auto unknown = session->open("x");
  ASSERT_FALSE(unknown.ok());
  EXPECT_EQ(unknown.error().failure, Failure::refused);
  EXPECT_EQ(unknown.error().code, ErrorCode::unknown_mesh);
  EXPECT_EQ(unknown.error().text, "the server refused (unknown_mesh, 35): there is no mesh \"x\"");
  const auto opened = session->open("m");
  ASSERT_TRUE(opened.ok()) << opened.error().text;
  ASSERT_TRUE(session->next_packet(opened->handle).ok());
  const auto failed = session->next_packet(opened->handle);
  ASSERT_FALSE(failed.ok());
  EXPECT_EQ(failed.error().failure, Failure::refused);
  EXPECT_EQ(failed.error().code, ErrorCode::unavailable);
  const auto again = session->next_packet(opened->handle);
  ASSERT_TRUE(again.ok()) << "the place did not move";
  EXPECT_EQ((*again)->number, 1u);
  EXPECT_EQ(session->next_packet(77).error().failure, Failure::no_such_handle);
}

TEST(Session, FramesOfLaterVersionsAreSkipped) {
  const MockMesh mesh = mock_mesh({10});
  MockServer server([&](MockServer& s) {
    auto peer = s.accept_session();
    peer.request.send_bytes(proto::make_frame(static_cast<proto::FrameType>(0x000a), {}));
    peer.data.send_bytes(proto::make_frame(static_cast<proto::FrameType>(0x7777), mesh.directory));
    MockServer::serve_base(peer, mesh);
    peer.request.expect<proto::Goodbye>();
  });
  auto session = Session::connect(server.address(), quick());
  ASSERT_TRUE(session.ok());
  const auto opened = session->open("m");
  ASSERT_TRUE(opened.ok()) << opened.error().text;
  EXPECT_TRUE(session->next_packet(opened->handle).ok());
}

TEST(Session, NobodyListens) {
  std::uint16_t port = 0;
  { port = testing::Socket::listen().port(); }
  const auto session = Session::connect({"127.0.0.1", port}, quick());
  ASSERT_FALSE(session.ok());
  EXPECT_EQ(session.error().failure, Failure::cannot_reach);
  EXPECT_NE(session.error().text.find("is pmcd running there"), std::string::npos) << session.error().text;
}

TEST(Session, NoSuchHost) {
  const auto session = Session::connect({"no-such-host.invalid", 1}, quick());
  ASSERT_FALSE(session.ok());
  EXPECT_TRUE(session.error().failure == Failure::cannot_reach || session.error().failure == Failure::timed_out);
  EXPECT_NE(session.error().text.find("no-such-host.invalid"), std::string::npos);
}

TEST(Session, ASilentServerIsGivenUp) {
  MockServer server([](MockServer& s) {
    Line line = s.accept_request();
    line.expect<proto::Hello>();
    line.closed();
  });
  Options options = quick();
  options.connect_timeout = 200ms;
  const auto session = Session::connect(server.address(), options);
  ASSERT_FALSE(session.ok());
  EXPECT_EQ(session.error().failure, Failure::timed_out);
}

TEST(Session, OtherServersAreRefused) {
  MockServer server([](MockServer& s) {
    Line line = s.accept_request();
    line.send_bytes(proto::as_bytes("HTTP/1.1 400 Bad Request\r\n\r\n"));
    line.expect<proto::Hello>();
  });
  const auto session = Session::connect(server.address(), quick());
  ASSERT_FALSE(session.ok());
  EXPECT_EQ(session.error().failure, Failure::violation);
  EXPECT_NE(session.error().text.find("not pmcd's protocol"), std::string::npos) << session.error().text;
}

TEST(Session, ARefusedVersionIsTold) {
  MockServer server([](MockServer& s) {
    Line line = s.accept_request();
    line.expect<proto::Hello>();
    line.send(proto::ErrorMessage{0, ErrorCode::unsupported_version, "this server speaks 2.0"});
  });
  const auto session = Session::connect(server.address(), quick());
  ASSERT_FALSE(session.ok());
  EXPECT_EQ(session.error().failure, Failure::refused);
  EXPECT_EQ(session.error().code, ErrorCode::unsupported_version);
}

TEST(Session, ABadTokenIsTold) {
  MockServer server([](MockServer& s) {
    Line line = s.accept_request();
    line.expect<proto::Hello>();
    proto::HelloOk ok;
    ok.data_port = s.data_port();
    line.send(ok);
    Line data = s.accept_data();
    data.expect<proto::Join>();
    data.send(proto::ErrorMessage{0, ErrorCode::bad_token, ""});
  });
  const auto session = Session::connect(server.address(), quick());
  ASSERT_FALSE(session.ok());
  EXPECT_EQ(session.error().failure, Failure::refused);
  EXPECT_EQ(session.error().code, ErrorCode::bad_token);
}

TEST(Session, AReasonOnTheOtherChannelIsHeardBeforeTheLossIsTold) {
  MockServer server([](MockServer& s) {
    auto peer = s.accept_session();
    peer.request.expect<proto::GetBaseMesh>();
    peer.data.close();
    std::this_thread::sleep_for(100ms);
    peer.request.send(proto::ErrorMessage{0, ErrorCode::shutting_down, "bye"});
    peer.request.closed();
  });
  const Error error = first_error(server);
  EXPECT_EQ(error.failure, Failure::refused);
  EXPECT_EQ(error.code, ErrorCode::shutting_down);
}

TEST(Session, ALostChannelEndsTheSessionForGood) {
  const MockMesh mesh = mock_mesh({300, 50});
  MockServer server([&](MockServer& s) {
    auto peer = s.accept_session();
    MockServer::serve_base(peer, mesh);
    const auto id = peer.request.expect<proto::GetNextPacket>().id;
    peer.data.send_chunk({id, 1, 1, 0, mesh.packets[1].size()}, proto::ByteView(mesh.packets[1]).first(10));
    peer.data.close();
    peer.request.closed();
  });
  auto session = Session::connect(server.address(), quick());
  ASSERT_TRUE(session.ok());
  const auto opened = session->open("m");
  ASSERT_TRUE(opened.ok() && session->next_packet(opened->handle).ok());
  const auto lost = session->next_packet(opened->handle);
  ASSERT_FALSE(lost.ok());
  EXPECT_EQ(lost.error().failure, Failure::lost);
  EXPECT_EQ(session->next_packet(opened->handle).error().failure, Failure::lost);
  EXPECT_EQ(session->open("m").error().failure, Failure::lost);
  EXPECT_EQ(session->list().error().failure, Failure::lost);
  EXPECT_EQ(session->ping().error().failure, Failure::lost);
}

TEST(Session, WaitingInAQueueIsNotSilence) {
  const MockMesh mesh = mock_mesh({10});
  MockServer server([&](MockServer& s) {
    auto peer = s.accept_session();
    const auto id = peer.request.expect<proto::GetBaseMesh>().id;
    peer.request.send(proto::MeshOpened{id, 1, mesh.generation, mesh.directory});
    for (int i = 0; i < 4; ++i) peer.request.send(proto::Pong{peer.request.expect<proto::Ping>().id});
    MockServer::send_packet(peer, id, mesh, 0);
    peer.request.expect<proto::Goodbye>();
  });
  Options options = quick();
  options.silence_timeout = 200ms;
  auto session = Session::connect(server.address(), options);
  ASSERT_TRUE(session.ok());
  const auto opened = session->open("m");
  ASSERT_TRUE(opened.ok());
  const auto packet = session->next_packet(opened->handle);
  ASSERT_TRUE(packet.ok()) << packet.error().text;
  session->close();
  EXPECT_EQ(server.finish(), "");
}

TEST(Session, SilenceAndStandstillAreTimeOuts) {
  const auto script = [](bool pong) {
    return [pong](MockServer& s) {
      auto peer = s.accept_session();
      peer.request.expect<proto::GetBaseMesh>();
      try {
        for (;;) {
          const auto id = peer.request.expect<proto::Ping>().id;
          if (pong) peer.request.send(proto::Pong{id});
        }
      } catch (const std::exception&) {
        // The client went away, as it should.
      }
    };
  };
  Options options = quick();
  options.silence_timeout = 300ms;
  options.progress_timeout = 900ms;
  MockServer silent(script(false));
  const Error silence = first_error(silent, options);
  EXPECT_EQ(silence.failure, Failure::timed_out);
  EXPECT_NE(silence.text.find("silent"), std::string::npos) << silence.text;
  MockServer stuck(script(true));
  const Error standstill = first_error(stuck, options);
  EXPECT_EQ(standstill.failure, Failure::timed_out);
  EXPECT_NE(standstill.text.find("nothing of what was asked"), std::string::npos) << standstill.text;
}

TEST(Session, Ping) {
  MockServer server([](MockServer& s) {
    auto peer = s.accept_session();
    const auto id = peer.request.expect<proto::Ping>().id;
    peer.request.send(proto::Pong{id + 1});
    std::this_thread::sleep_for(50ms);
    peer.request.send(proto::Pong{id});
  });
  auto session = Session::connect(server.address(), quick());
  ASSERT_TRUE(session.ok());
  const auto time = session->ping();
  ASSERT_TRUE(time.ok()) << time.error().text;
  EXPECT_GE(*time, 50ms) << "the pong of another ping does not count";
}

}  // namespace
}  // namespace pmcd::client
