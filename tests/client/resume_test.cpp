// SPDX-License-Identifier: MIT
// What a Session does beyond the straight way: resume, cancel and its races, notices, stops from another thread, and a
// look-up that hangs.
#include <gtest/gtest.h>

#include <atomic>
#include <stop_token>
#include <thread>
#include <vector>

#include "client/session.h"
#include "tests/client/mock_server.h"

namespace pmcd::client {
namespace {

using namespace std::chrono_literals;
using proto::ErrorCode;
using proto::TransferEnd;
using proto::TransferResult;
using testing::mock_mesh;
using testing::MockMesh;
using testing::MockServer;
using testing::quick;

proto::Bytes first_bytes(const proto::Bytes& bytes, std::size_t count) {
  return {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(count)};
}

const OnProgress kStopAtOnce = [](const Progress&) { return false; };

/// A session on mesh "m" with packet 0 taken.
struct Begun {
  explicit Begun(MockServer& server, const Options& options = quick())
      : session(Session::connect(server.address(), options)) {
    EXPECT_TRUE(session.ok());
    const auto opened = session->open("m");
    EXPECT_TRUE(opened.ok());
    handle = opened->handle;
    EXPECT_TRUE(session->next_packet(handle).ok());
  }
  Result<Session> session;
  std::uint32_t handle = 0;
};

TEST(Resume, InANewSessionBehindWhatIsThere) {
  const MockMesh mesh = mock_mesh({10, 500, 70});
  MockServer server([&](MockServer& s) {
    auto peer = s.accept_session();
    MockServer::serve_rest(peer, mesh, 1, 123);
    MockServer::serve_next(peer, mesh, 2);
  });
  auto session = Session::connect(server.address(), quick());
  ASSERT_TRUE(session.ok());
  const auto opened = session->resume(mesh.generation, 1, first_bytes(mesh.packets[1], 123));
  ASSERT_TRUE(opened.ok()) << opened.error().text;
  EXPECT_EQ(opened->directory_bytes, mesh.directory);
  std::vector<std::uint64_t> received;
  proto::Bytes fresh;
  const auto packet = session->next_packet(opened->handle, [&](const Progress& progress) {
    received.push_back(progress.received);
    fresh.insert(fresh.end(), progress.bytes.begin(), progress.bytes.end());
    return true;
  });
  ASSERT_TRUE(packet.ok() && *packet);
  EXPECT_EQ((*packet)->number, 1u);
  EXPECT_EQ((*packet)->bytes, mesh.packets[1]) << "whole, with the beginning that was there";
  EXPECT_EQ(fresh, proto::Bytes(mesh.packets[1].begin() + 123, mesh.packets[1].end())) << "only what came is told";
  EXPECT_EQ(received.back(), mesh.packets[1].size());
  const auto next = session->next_packet(opened->handle);
  ASSERT_TRUE(next.ok() && *next);
  EXPECT_EQ((*next)->bytes, mesh.packets[2]);
  EXPECT_EQ(server.finish(), "");
}

TEST(Resume, OfAMeshThatIsOpenUsesItsHandle) {
  const MockMesh mesh = mock_mesh({10, 500, 70});
  MockServer server([&](MockServer& s) {
    auto peer = s.accept_session();
    MockServer::serve_base(peer, mesh, 5);
    MockServer::serve_rest(peer, mesh, 2, 0, false, 5);
    MockServer::serve_rest(peer, mesh, 1, 40, false, 5);
  });
  Begun begun(server);
  const auto last = begun.session->resume(mesh.generation, 2);
  ASSERT_TRUE(last.ok()) << last.error().text;
  EXPECT_EQ(last->handle, 5u);
  EXPECT_EQ((*begun.session->next_packet(5))->bytes, mesh.packets[2]);
  ASSERT_TRUE(begun.session->resume(mesh.generation, 1, first_bytes(mesh.packets[1], 40)).ok());
  EXPECT_EQ((*begun.session->next_packet(5))->bytes, mesh.packets[1]);
  for (const auto& beyond :
       {begun.session->resume(mesh.generation, 3), begun.session->resume(mesh.generation, 1, mesh.packets[1])}) {
    ASSERT_FALSE(beyond.ok());
    EXPECT_EQ(beyond.error().code, ErrorCode::bad_range);
  }
  EXPECT_EQ(server.finish(), "");
}

TEST(Resume, RefusalsEndTheRequestOnly) {
  const MockMesh mesh = mock_mesh({10, 500});
  MockServer server([&](MockServer& s) {
    auto peer = s.accept_session();
    for (const ErrorCode code : {ErrorCode::mesh_changed, ErrorCode::bad_range}) {
      peer.request.send(proto::ErrorMessage{peer.request.expect<proto::GetPacket>().id, code, "no"});
    }
    MockServer::serve_base(peer, mesh);
  });
  auto session = Session::connect(server.address(), quick());
  ASSERT_TRUE(session.ok());
  EXPECT_EQ(session->resume(9, 0).error().code, ErrorCode::mesh_changed);
  EXPECT_EQ(session->resume(9, 7).error().code, ErrorCode::bad_range);
  EXPECT_TRUE(session->open("m").ok());
}

TEST(Resume, AWrongOffsetOrAnotherGenerationIsCaught) {
  const MockMesh mesh = mock_mesh({10, 500});
  struct Case {
    std::size_t offset;
    std::uint64_t generation;
    const char* says;
  };
  for (const Case& wrong : {Case{99, mesh.generation, "begins at byte 99, expected was 100"},
                            Case{0, mesh.generation, "begins at byte 0, expected was 100"},
                            Case{100, mesh.generation + 1, "another generation"}}) {
    MockServer server([&](MockServer& s) {
      auto peer = s.accept_session();
      const auto id = peer.request.expect<proto::GetPacket>().id;
      peer.request.send(proto::MeshOpened{id, 1, mesh.generation, mesh.directory});
      MockServer::send_packet(peer, id, mesh, 1, 1, wrong.offset);
    });
    auto session = Session::connect(server.address(), quick());
    ASSERT_TRUE(session.ok());
    const auto opened = session->resume(wrong.generation, 1, first_bytes(mesh.packets[1], 100));
    const auto packet = opened ? session->next_packet(opened->handle) : Result<std::optional<Packet>>(opened.error());
    ASSERT_FALSE(packet.ok());
    EXPECT_EQ(packet.error().failure, Failure::violation);
    EXPECT_NE(packet.error().text.find(wrong.says), std::string::npos) << packet.error().text;
  }
}

TEST(Resume, ADirectoryWithoutThePacketIsCaught) {
  const MockMesh mesh = mock_mesh({10, 500});
  MockServer server([&](MockServer& s) {
    auto peer = s.accept_session();
    const auto id = peer.request.expect<proto::GetPacket>().id;
    peer.request.send(proto::MeshOpened{id, 1, mesh.generation, mesh.directory});
    peer.request.closed();
  });
  auto session = Session::connect(server.address(), quick());
  ASSERT_TRUE(session.ok());
  const auto opened = session->resume(mesh.generation, 2);
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.error().failure, Failure::violation);
}

TEST(Resume, WhatALostLineBroughtCanBeTakenToTheByte) {
  const MockMesh mesh = mock_mesh({10, 500});
  for (const std::size_t cut : {1u, 99u, 100u, 101u, 250u}) {
    MockServer server([&](MockServer& s) {
      auto peer = s.accept_session();
      MockServer::serve_base(peer, mesh);
      const auto id = peer.request.expect<proto::GetNextPacket>().id;
      // One long chunk, of which `cut` bytes leave before the line breaks.
      const auto header = proto::encode_chunk_header({id, 1, 1, 0, mesh.packets[1].size()},
                                                     static_cast<std::uint32_t>(mesh.packets[1].size()));
      peer.data.send_bytes(header);
      peer.data.send_bytes(proto::ByteView(mesh.packets[1]).first(cut));
      peer.data.close();
      peer.request.close();
    });
    Begun begun(server);
    std::uint64_t told = 0;
    const auto packet = begun.session->next_packet(begun.handle, [&](const Progress& progress) {
      told += progress.bytes.size();
      return true;
    });
    ASSERT_FALSE(packet.ok());
    EXPECT_EQ(packet.error().failure, Failure::lost);
    EXPECT_EQ(told, cut);
    EXPECT_EQ(begun.session->take_partial(begun.handle), first_bytes(mesh.packets[1], cut));
    EXPECT_TRUE(begun.session->take_partial(begun.handle).empty()) << "given away once";
    EXPECT_TRUE(begun.session->take_partial(77).empty());
  }
}

TEST(Resume, BytesWhoseAnswerWasLostCanBeTakenToo) {
  const MockMesh mesh = mock_mesh({10, 500});
  MockServer server([&](MockServer& s) {
    auto peer = s.accept_session();
    MockServer::send_part(peer, MockServer::expect_get_packet(peer, mesh, 1, 20), mesh, 1, 20, 120);
  });
  auto session = Session::connect(server.address(), quick());
  ASSERT_TRUE(session.ok());
  EXPECT_EQ(session->resume(mesh.generation, 1, first_bytes(mesh.packets[1], 20)).error().failure, Failure::lost);
  EXPECT_EQ(session->take_partial(0), first_bytes(mesh.packets[1], 120));
  EXPECT_EQ(session->next_packet(0).error().failure, Failure::lost);
}

TEST(Resume, WhatCameBeforeTheEndOfTheSessionIsStillGiven) {
  const MockMesh mesh = mock_mesh({10, 20, 30});
  for (const bool whole : {true, false}) {
    MockServer server([&](MockServer& s) {
      auto peer = s.accept_session();
      const auto id = peer.request.expect<proto::GetBaseMesh>().id;
      peer.request.send(proto::MeshOpened{id, 1, mesh.generation, mesh.directory});
      MockServer::send_part(peer, id, mesh, 0, 0, 30);
      if (whole) {
        MockServer::send_part(peer, id, mesh, 0, 30, mesh.packets[0].size());
        peer.data.send(TransferEnd{id, TransferResult::complete, ErrorCode::none});
      }
    });
    auto session = Session::connect(server.address(), quick());
    ASSERT_TRUE(session.ok());
    const auto opened = session->open("m");
    ASSERT_TRUE(opened.ok());
    EXPECT_EQ(session->ping().error().failure, Failure::lost) << "the end is noticed here";
    std::uint64_t told = 0;
    const auto packet = session->next_packet(opened->handle, [&](const Progress& progress) {
      told += progress.bytes.size();
      return true;
    });
    EXPECT_EQ(packet.ok(), whole);
    EXPECT_EQ(told, whole ? mesh.packets[0].size() : 30u);
    EXPECT_EQ(packet.ok() ? (*packet)->bytes : mesh.packets[0], mesh.packets[0]);
    EXPECT_EQ(session->next_packet(opened->handle).error().failure, Failure::lost);
  }
}

TEST(Cancel, TheNextCallGoesOnAtTheByte) {
  const MockMesh mesh = mock_mesh({10, 500, 20});
  MockServer server([&](MockServer& s) {
    auto peer = s.accept_session();
    MockServer::serve_base(peer, mesh);
    const auto id = peer.request.expect<proto::GetNextPacket>().id;
    MockServer::send_part(peer, id, mesh, 1, 0, 200);
    if (peer.request.expect<proto::Cancel>().id != id) throw std::runtime_error("cancel of another request");
    MockServer::send_part(peer, id, mesh, 1, 200, 300);  // was on its way
    peer.data.send(TransferEnd{id, TransferResult::cancelled, ErrorCode::none});
    MockServer::serve_rest(peer, mesh, 1, 300, false);
    MockServer::serve_next(peer, mesh, 2);
  });
  Begun begun(server);
  const auto cancelled = begun.session->next_packet(begun.handle, kStopAtOnce);
  ASSERT_FALSE(cancelled.ok());
  EXPECT_EQ(cancelled.error().failure, Failure::cancelled);
  const auto again = begun.session->next_packet(begun.handle);
  ASSERT_TRUE(again.ok()) << again.error().text;
  EXPECT_EQ((*again)->bytes, mesh.packets[1]);
  EXPECT_EQ((*begun.session->next_packet(begun.handle))->bytes, mesh.packets[2]);
  EXPECT_EQ(server.finish(), "");
}

TEST(Cancel, TooLateGivesThePacket) {
  const MockMesh mesh = mock_mesh({10, 500, 20});
  MockServer server([&](MockServer& s) {
    auto peer = s.accept_session();
    MockServer::serve_base(peer, mesh);
    const auto id = peer.request.expect<proto::GetNextPacket>().id;
    MockServer::send_part(peer, id, mesh, 1, 0, 100);
    peer.request.expect<proto::Cancel>();
    MockServer::send_packet(peer, id, mesh, 1, 1, 100);  // its end crossed the cancel
    MockServer::serve_next(peer, mesh, 2);
  });
  Begun begun(server);
  const auto packet = begun.session->next_packet(begun.handle, kStopAtOnce);
  ASSERT_TRUE(packet.ok()) << packet.error().text;
  EXPECT_EQ((*packet)->bytes, mesh.packets[1]);
  EXPECT_EQ((*begun.session->next_packet(begun.handle))->bytes, mesh.packets[2]);
  EXPECT_EQ(server.finish(), "");
}

TEST(Cancel, FromAnotherThreadWhileItWaitsInTheQueue) {
  const MockMesh mesh = mock_mesh({10, 500});
  std::stop_source source;
  MockServer server([&](MockServer& s) {
    auto peer = s.accept_session();
    MockServer::serve_base(peer, mesh);
    const auto id = peer.request.expect<proto::GetNextPacket>().id;
    source.request_stop();  // this is the other thread
    peer.request.expect<proto::Cancel>();
    peer.data.send(TransferEnd{id, TransferResult::cancelled, ErrorCode::none});
    MockServer::serve_next(peer, mesh, 1);
  });
  Begun begun(server);
  const auto cancelled = begun.session->next_packet(begun.handle, {}, source.get_token());
  ASSERT_FALSE(cancelled.ok());
  EXPECT_EQ(cancelled.error().failure, Failure::cancelled);
  EXPECT_EQ((*begun.session->next_packet(begun.handle))->bytes, mesh.packets[1]);
  EXPECT_EQ(server.finish(), "");
}

TEST(Cancel, ThatIsNeverAnsweredEnds) {
  const MockMesh mesh = mock_mesh({10, 500});
  MockServer server([&](MockServer& s) {
    auto peer = s.accept_session();
    MockServer::serve_base(peer, mesh);
    const auto id = peer.request.expect<proto::GetNextPacket>().id;
    MockServer::send_part(peer, id, mesh, 1, 0, 100);
    peer.request.expect<proto::Cancel>();
    peer.data.closed();
  });
  Options options = quick();
  options.silence_timeout = 300ms;
  Begun begun(server, options);
  EXPECT_EQ(begun.session->next_packet(begun.handle, kStopAtOnce).error().failure, Failure::timed_out);
  EXPECT_EQ(begun.session->take_partial(begun.handle).size(), 100u);
}

TEST(Cancel, ATransferThatIsGivenUpIsCancelled) {
  const MockMesh mesh = mock_mesh({300, 50});
  MockServer server([&](MockServer& s) {
    auto peer = s.accept_session();
    const auto first = peer.request.expect<proto::GetBaseMesh>().id;
    peer.request.send(proto::MeshOpened{first, 1, mesh.generation, mesh.directory});
    const auto second = peer.request.expect<proto::GetBaseMesh>().id;
    peer.request.send(proto::MeshOpened{second, 1, mesh.generation, mesh.directory});
    if (peer.request.expect<proto::Cancel>().id != first) throw std::runtime_error("cancel of another request");
    peer.data.send(TransferEnd{first, TransferResult::cancelled, ErrorCode::none});
    MockServer::send_packet(peer, second, mesh, 0);
  });
  auto session = Session::connect(server.address(), quick());
  ASSERT_TRUE(session.ok());
  ASSERT_TRUE(session->open("m").ok());
  const auto again = session->open("m");
  ASSERT_TRUE(again.ok());
  EXPECT_EQ((*session->next_packet(again->handle))->bytes, mesh.packets[0]);
  EXPECT_EQ(server.finish(), "");
}

TEST(Stop, EndsAWaitFromAnotherThreadAndSaysGoodbye) {
  const MockMesh mesh = mock_mesh({10, 500});
  std::stop_source source;
  MockServer server([&](MockServer& s) {
    auto peer = s.accept_session();
    MockServer::serve_base(peer, mesh);
    MockServer::send_part(peer, peer.request.expect<proto::GetNextPacket>().id, mesh, 1, 0, 200);
    peer.request.expect<proto::Goodbye>();
  });
  Options options = quick();
  options.stop = source.get_token();
  Begun begun(server, options);
  std::jthread other;
  const auto stopped = begun.session->next_packet(begun.handle, [&](const Progress& progress) {
    if (progress.received == 200) other = std::jthread([&] { source.request_stop(); });
    return true;
  });
  ASSERT_FALSE(stopped.ok());
  EXPECT_EQ(stopped.error().failure, Failure::cancelled);
  EXPECT_EQ(begun.session->take_partial(begun.handle), first_bytes(mesh.packets[1], 200));
  EXPECT_EQ(begun.session->ping().error().failure, Failure::cancelled) << "for good";
  EXPECT_EQ(server.finish(), "");
}

TEST(Stop, EndsConnecting) {
  std::stop_source source;
  MockServer server([&](MockServer& s) {
    auto line = s.accept_request();
    line.expect<proto::Hello>();
    source.request_stop();
    line.expect<proto::Goodbye>();
  });
  Options options = quick();
  options.connect_timeout = 60s;
  options.stop = source.get_token();
  const auto before = std::chrono::steady_clock::now();
  const auto session = Session::connect(server.address(), options);
  ASSERT_FALSE(session.ok());
  EXPECT_EQ(session.error().failure, Failure::cancelled);
  EXPECT_LT(std::chrono::steady_clock::now() - before, 5s);
}

TEST(Notices, AreHandedOverAndUnknownKindsSkipped) {
  const MockMesh mesh = mock_mesh({10});
  const proto::Notice draining{proto::NoticeKind::draining, 0, 5, "upgrade"};
  const proto::Notice retired{proto::NoticeKind::mesh_retired, 1, 600, "gone"};
  MockServer server([&](MockServer& s) {
    auto peer = s.accept_session();
    peer.request.send(draining);
    peer.request.send(proto::Notice{static_cast<proto::NoticeKind>(77), 0, 0, "later"});
    peer.request.send(retired);
    MockServer::serve_base(peer, mesh);
  });
  std::vector<proto::Notice> seen;
  Options options = quick();
  options.on_notice = [&](const proto::Notice& notice) { seen.push_back(notice); };
  const Begun begun(server, options);
  EXPECT_EQ(seen, (std::vector{draining, retired}));
}

TEST(Lists, PagesUntilTheLast) {
  std::vector<proto::MeshListEntry> entries(3);
  for (std::size_t i = 0; i < 3; ++i) entries[i].name = std::string(1, static_cast<char>('a' + i));
  std::vector<proto::GetMeshList> asked;
  MockServer server([&](MockServer& s) {
    auto peer = s.accept_session();
    for (std::uint32_t page = 0; page < 2; ++page) {
      asked.push_back(peer.request.expect<proto::GetMeshList>());
      const std::vector<proto::MeshListEntry> some(entries.begin() + page * 2, entries.begin() + (page == 0 ? 2 : 3));
      const proto::Bytes bytes = proto::encode_mesh_page({3, 1 - page, some});
      peer.data.send_chunk({asked.back().id, 0, 0, 0, bytes.size()}, bytes);
      peer.data.send(TransferEnd{asked.back().id, TransferResult::complete, ErrorCode::none});
    }
  });
  auto session = Session::connect(server.address(), quick());
  ASSERT_TRUE(session.ok());
  const auto all = session->list("X");
  ASSERT_TRUE(all.ok()) << all.error().text;
  EXPECT_EQ(*all, entries);
  EXPECT_EQ(server.finish(), "");
  ASSERT_EQ(asked.size(), 2u);
  EXPECT_EQ(asked[0].filter, "X");
  EXPECT_EQ(asked[0].after, "");
  EXPECT_EQ(asked[1].after, "b");
}

}  // namespace
}  // namespace pmcd::client
