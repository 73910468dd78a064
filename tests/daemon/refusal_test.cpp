// SPDX-License-Identifier: MIT
// What clients get when they do something wrong: for each fault its code, and whether the session lives on.
#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "tests/daemon/raw_client.h"
#include "tests/daemon/server_in_thread.h"

namespace pmcd::test {
namespace {

using proto::Bytes;
using proto::FrameType;

Bytes raw(std::initializer_list<unsigned> bytes) {
  Bytes out;
  for (const unsigned b : bytes) out.push_back(static_cast<std::byte>(b));
  return out;
}

/// The frame with one byte of its body replaced. `at` counts from the start of the body.
Bytes with_byte(Bytes frame, std::size_t at, unsigned value) {
  frame[proto::kFrameHeaderBytes + at] = static_cast<std::byte>(value);
  return frame;
}

/// Sends `frame` as the first of a connection to `port` and returns the code of the answer, which must end it.
std::string first_frame(std::uint16_t port, const Bytes& frame) {
  auto connection = RawConnection::tcp(port);
  connection.send(frame);
  const std::string code = expect_error(connection, 0);
  EXPECT_TRUE(connection.closes());
  return code;
}

TEST(Refusal, FirstFrameOfTheRequestChannel) {
  ServerInThread server;
  const std::uint16_t port = server.request_port();
  const Bytes hello = proto::encode(proto::Hello{{}, "x"});
  EXPECT_EQ(first_frame(port, with_byte(hello, 0, 'X')), "bad_magic");
  EXPECT_EQ(first_frame(port, with_byte(hello, 4, 2)), "unsupported_version");
  EXPECT_EQ(first_frame(port, proto::encode(proto::Ping{1})), "wrong_state");
  EXPECT_EQ(first_frame(port, proto::encode(proto::GetMeshList{1})), "wrong_state");
  EXPECT_EQ(first_frame(port, proto::encode(proto::Join{})), "wrong_state");
  EXPECT_EQ(first_frame(port, raw({2, 0, 0, 0, 0xff, 0x7f})), "wrong_state");
  EXPECT_EQ(first_frame(port, raw({3, 0, 0, 0, 1, 0, 0})), "malformed");
  EXPECT_EQ(first_frame(port, raw({1, 0, 0, 0, 1})), "malformed");
  EXPECT_EQ(first_frame(port, raw({0, 0, 0, 0})), "malformed");
  EXPECT_EQ(first_frame(port, raw({1, 16, 0, 0, 1, 0})), "frame_too_long");
  EXPECT_EQ(first_frame(port, raw({0xff, 0xff, 0xff, 0xff})), "frame_too_long");
  EXPECT_EQ(first_frame(port, raw({'G', 'E', 'T', ' ', '/', '\r', '\n'})), "frame_too_long");
  EXPECT_NE(RawSession::open(port).requests.fd(), -1) << "the server is unharmed";
}

TEST(Refusal, FirstFrameOfTheDataChannel) {
  ServerInThread server;
  const std::uint16_t port = server.data_port();
  const Bytes join = proto::encode(proto::Join{});
  EXPECT_EQ(first_frame(port, join), "bad_token");
  EXPECT_EQ(first_frame(port, with_byte(join, 0, 'X')), "bad_magic");
  EXPECT_EQ(first_frame(port, with_byte(join, 4, 2)), "unsupported_version");
  EXPECT_EQ(first_frame(port, proto::encode(proto::Hello{{}, "x"})), "wrong_state");
  EXPECT_EQ(first_frame(port, raw({3, 0, 0, 0, 7, 0, 0})), "malformed");
  EXPECT_EQ(first_frame(port, raw({0xff, 0xff, 0xff, 0x7f})), "frame_too_long");
}

TEST(Refusal, TokenIsGoodOnceAndOnlyForItsSession) {
  ServerInThread server;
  auto requests = RawConnection::tcp(server.request_port());
  requests.send(proto::encode(proto::Hello{{}, "x"}));
  const auto hello = expect<proto::HelloOk>(requests);
  proto::Token wrong = hello.token;
  wrong[7] ^= std::byte{1};
  EXPECT_EQ(first_frame(server.data_port(), proto::encode(proto::Join{{}, wrong})), "bad_token");
  auto data = RawConnection::tcp(server.data_port());
  data.send(proto::encode(proto::Join{{}, hello.token}));
  expect<proto::JoinOk>(data);
  EXPECT_EQ(first_frame(server.data_port(), proto::encode(proto::Join{{}, hello.token})), "bad_token");
  requests.send(proto::encode(proto::Ping{3}));
  EXPECT_EQ(expect<proto::Pong>(requests).id, 3U) << "the session that joined is unharmed";
}

TEST(Refusal, TokenOfALostSessionIsWorthless) {
  ServerInThread server;
  auto requests = RawConnection::tcp(server.request_port());
  requests.send(proto::encode(proto::Hello{{}, "x"}));
  const auto hello = expect<proto::HelloOk>(requests);
  requests.send(proto::encode(proto::Goodbye{}));
  EXPECT_TRUE(requests.closes());
  EXPECT_EQ(first_frame(server.data_port(), proto::encode(proto::Join{{}, hello.token})), "bad_token");
}

TEST(Refusal, BeforeJoinOnlyPingAndGoodbye) {
  ServerInThread server;
  auto requests = RawConnection::tcp(server.request_port());
  requests.send(proto::encode(proto::Hello{{}, "x"}));
  expect<proto::HelloOk>(requests);
  requests.send(proto::encode(proto::Ping{0}));
  EXPECT_EQ(expect<proto::Pong>(requests).id, 0U);
  requests.send(proto::encode(proto::GetMeshList{4}));
  EXPECT_EQ(expect_error(requests, 4), "not_joined");
  requests.send(proto::encode(proto::GetBaseMesh{5, "m"}));
  EXPECT_EQ(expect_error(requests, 5), "not_joined");
  requests.send(proto::encode(proto::GetNextPacket{6, 1}));
  EXPECT_EQ(expect_error(requests, 6), "not_joined");
  requests.send(proto::make_frame(static_cast<FrameType>(0x7777), raw({9, 0, 0, 0, 1, 2, 3})));
  EXPECT_EQ(expect_error(requests, 9), "unknown_type");
  requests.send(proto::encode(proto::Hello{{}, "x"}));
  EXPECT_EQ(expect_error(requests, 0), "wrong_state");
  EXPECT_TRUE(requests.closes());
}

/// Runs `fault` in a fresh joined session; the code that comes must be `code`, and end the session or not.
void in_session(ServerInThread& server, const std::string& code, std::optional<std::uint32_t> id, bool ends,
                const std::function<void(RawSession&)>& fault) {
  SCOPED_TRACE(code);
  auto session = RawSession::open(server.request_port());
  fault(session);
  EXPECT_EQ(expect_error(session.requests, id), code);
  if (ends) {
    EXPECT_TRUE(session.requests.closes());
    EXPECT_TRUE(session.data.closes());
  } else {
    session.requests.send(proto::encode(proto::Ping{1}));
    EXPECT_EQ(expect<proto::Pong>(session.requests).id, 1U);
  }
}

TEST(Refusal, OfRequestsLeavesTheSession) {
  ServerInThread server;
  ASSERT_EQ(RawAdmin::open(server.admin_socket()).ingest("m", fake_mesh(1, {10})), "ok");
  const auto sends = [](const Bytes& frame) { return [frame](RawSession& s) { s.requests.send(frame); }; };
  in_session(server, "unknown_mesh", 3, false, sends(proto::encode(proto::GetBaseMesh{3, "no such"})));
  in_session(server, "bad_name", 3, false, sends(proto::encode(proto::GetBaseMesh{3, ""})));
  in_session(server, "bad_name", 3, false, sends(proto::encode(proto::GetBaseMesh{3, "a/b"})));
  in_session(server, "bad_name", 3, false, sends(proto::encode(proto::GetBaseMesh{3, "a\x1b[2J"})));
  in_session(server, "unknown_handle", 3, false, sends(proto::encode(proto::GetNextPacket{3, 0})));
  in_session(server, "unknown_handle", 3, false, sends(proto::encode(proto::GetNextPacket{3, 17})));
  in_session(server, "unknown_type", 5, false,
             sends(proto::make_frame(static_cast<FrameType>(0x6000), raw({5, 0, 0, 0, 9}))));
  in_session(server, "unknown_type", 0, false, sends(proto::make_frame(static_cast<FrameType>(0x6000), raw({5}))));
  in_session(server, "unknown_handle", 3, false, [](RawSession& s) {
    s.open_mesh(1, "m");
    s.next_transfer();
    s.requests.send(proto::encode(proto::GetNextPacket{3, 2}));
  });
}

TEST(Refusal, OfFramesEndsTheSession) {
  ServerInThread server;
  ASSERT_EQ(RawAdmin::open(server.admin_socket()).ingest("m", fake_mesh(1, {8'000'000})), "ok");
  const auto sends = [](const Bytes& frame) { return [frame](RawSession& s) { s.requests.send(frame); }; };
  in_session(server, "malformed", 0, true, sends(proto::make_frame(FrameType::get_mesh_list, raw({1, 0, 0}))));
  in_session(server, "malformed", 0, true, sends(proto::make_frame(FrameType::get_mesh_list, raw({1, 0, 0, 0, 0}))));
  in_session(server, "malformed", 0, true, sends(proto::encode(proto::GetMeshList{0})));
  in_session(server, "malformed", 0, true, sends(proto::make_frame(FrameType::goodbye, raw({1}))));
  in_session(server, "malformed", 0, true, sends(proto::make_frame(FrameType::ping, raw({1}))));
  in_session(server, "wrong_state", 0, true, sends(proto::encode(proto::Hello{{}, "again"})));
  in_session(server, "wrong_state", 0, true, sends(proto::encode(proto::TransferEnd{1})));
  in_session(server, "wrong_state", 0, true, sends(proto::encode(proto::AdminRemove{1, "m"})));
  in_session(server, "frame_too_long", 0, true, sends(raw({1, 16, 0, 0, 1, 0})));
  in_session(server, "duplicate_id", 0, true, [](RawSession& s) {
    s.open_mesh(1, "m");
    s.requests.send(proto::encode(proto::GetNextPacket{1, 0}));
  });
}

TEST(Refusal, FramesOnTheDataChannel) {
  ServerInThread server;
  auto session = RawSession::open(server.request_port());
  session.data.send(proto::make_frame(static_cast<FrameType>(0x6000), raw({5, 0, 0, 0})));
  EXPECT_EQ(expect_error(session.data), "unknown_type");
  session.requests.send(proto::encode(proto::Ping{1}));
  EXPECT_EQ(expect<proto::Pong>(session.requests).id, 1U);
  session.data.send(proto::encode(proto::Ping{1}));
  EXPECT_EQ(expect_error(session.data, 0), "wrong_state");
  EXPECT_TRUE(session.data.closes());
  EXPECT_EQ(expect_error(session.requests, 0), "channel_lost");
  EXPECT_TRUE(session.requests.closes());
}

/// Every byte value at every place of each client frame: an answer, an error or silence, and a server that goes on.
TEST(Refusal, NoByteOfAFrameHurtsTheServer) {
  net::Limits limits;
  limits.linger = std::chrono::milliseconds(20);
  ServerInThread server(limits);
  ASSERT_EQ(RawAdmin::open(server.admin_socket()).ingest("m", fake_mesh(1, {10, 10})), "ok");
  const std::vector<Bytes> frames = {proto::encode(proto::GetMeshList{1}), proto::encode(proto::GetBaseMesh{1, "m"}),
                                     proto::encode(proto::GetNextPacket{1, 0}), proto::encode(proto::Ping{1}),
                                     proto::encode(proto::Hello{{}, "x"})};
  for (const Bytes& frame : frames) {
    for (std::size_t at = 0; at < frame.size(); ++at) {
      for (const unsigned value : {0U, 1U, 0x7fU, 0x80U, 0xffU}) {
        Bytes damaged = frame;
        damaged[at] = static_cast<std::byte>(value);
        auto session = RawSession::open(server.request_port());
        session.requests.send(damaged);
        auto fresh = RawConnection::tcp(server.request_port());
        fresh.send(damaged);
      }
    }
  }
  auto session = RawSession::open(server.request_port());
  EXPECT_EQ(session.fetch("m").size(), 2U);
}

}  // namespace
}  // namespace pmcd::test
