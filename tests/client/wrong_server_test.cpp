// SPDX-License-Identifier: MIT
// Everything that a server may do wrong in answering get_base_mesh, and what the client says of it.
#include <gtest/gtest.h>

#include <functional>
#include <string>
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
using testing::first_error;
using testing::mock_mesh;
using testing::MockMesh;
using testing::MockServer;
using testing::quick;

struct Wrong {
  const char* name;
  std::function<void(MockServer::Peer& peer, std::uint32_t id, MockMesh mesh)> act;
  Failure failure;
  const char* says;
};

void open_right(MockServer::Peer& peer, std::uint32_t id, const MockMesh& mesh) {
  peer.request.send(proto::MeshOpened{id, 1, mesh.generation, mesh.directory});
}

class WrongServer : public ::testing::TestWithParam<Wrong> {};

TEST_P(WrongServer, IsCaught) {
  const MockMesh mesh = mock_mesh({300});
  MockServer server([&](MockServer& s) {
    auto peer = s.accept_session();
    GetParam().act(peer, peer.request.expect<proto::GetBaseMesh>().id, mesh);
    peer.request.closed();
  });
  Options options = quick();
  options.max_packet_bytes = 100'000;
  const Error error = first_error(server, options);
  EXPECT_STREQ(failure_name(error.failure), failure_name(GetParam().failure)) << error.text;
  EXPECT_NE(error.text.find(GetParam().says), std::string::npos) << error.text;
}

const std::vector<Wrong> all_wrongs{
    {"offset",
     [](auto& peer, auto id, auto mesh) {
       open_right(peer, id, mesh);
       peer.data.send_chunk({id, 1, 0, 1, mesh.packets[0].size()}, proto::ByteView(mesh.packets[0]).first(10));
     },
     Failure::violation, "begins at byte 1, expected was 0"},
    {"chunk_twice",
     [](auto& peer, auto id, auto mesh) {
       open_right(peer, id, mesh);
       for (int i = 0; i < 2; ++i) {
         peer.data.send_chunk({id, 1, 0, 0, mesh.packets[0].size()}, proto::ByteView(mesh.packets[0]).first(10));
       }
     },
     Failure::violation, "begins at byte 0, expected was 10"},
    {"total_changes",
     [](auto& peer, auto id, auto mesh) {
       open_right(peer, id, mesh);
       peer.data.send_chunk({id, 1, 0, 0, mesh.packets[0].size()}, proto::ByteView(mesh.packets[0]).first(10));
       peer.data.send_chunk({id, 1, 0, 10, 500}, proto::ByteView(mesh.packets[0]).first(10));
     },
     Failure::violation, "do not agree"},
    {"total_against_directory",
     [](auto& peer, auto id, auto mesh) {
       open_right(peer, id, mesh);
       peer.data.send_chunk({id, 1, 0, 0, 77}, proto::ByteView(mesh.packets[0]).first(10));
     },
     Failure::violation, "its directory says"},
    {"total_against_late_directory",
     [](auto& peer, auto id, auto mesh) {
       peer.data.send_chunk({id, 1, 0, 0, 77}, proto::ByteView(mesh.packets[0]).first(10));
       std::this_thread::sleep_for(50ms);
       open_right(peer, id, mesh);
     },
     Failure::violation, "its directory says"},
    {"huge_total",
     [](auto& peer, auto id, auto mesh) {
       peer.data.send_chunk({id, 1, 0, 0, std::uint64_t{1} << 60}, proto::ByteView(mesh.packets[0]).first(10));
     },
     Failure::limit_exceeded, "this client takes 100000"},
    {"other_handle",
     [](auto& peer, auto id, auto mesh) {
       open_right(peer, id, mesh);
       peer.data.send_chunk({id, 2, 0, 0, mesh.packets[0].size()}, proto::ByteView(mesh.packets[0]).first(10));
     },
     Failure::violation, "another mesh"},
    {"other_packet",
     [](auto& peer, auto id, auto mesh) {
       open_right(peer, id, mesh);
       peer.data.send_chunk({id, 1, 1, 0, mesh.packets[0].size()}, proto::ByteView(mesh.packets[0]).first(10));
     },
     Failure::violation, "packet 1 came instead of 0"},
    {"unknown_id",
     [](auto& peer, auto id, auto mesh) {
       open_right(peer, id, mesh);
       peer.data.send_chunk({id + 1, 1, 0, 0, mesh.packets[0].size()}, proto::ByteView(mesh.packets[0]).first(10));
     },
     Failure::violation, "not open"},
    {"ends_early",
     [](auto& peer, auto id, auto mesh) {
       open_right(peer, id, mesh);
       peer.data.send_chunk({id, 1, 0, 0, mesh.packets[0].size()}, proto::ByteView(mesh.packets[0]).first(10));
       peer.data.send(TransferEnd{id, TransferResult::complete, ErrorCode::none});
     },
     Failure::violation, "complete after 10 of"},
    {"ends_twice",
     [](auto& peer, auto id, auto mesh) {
       MockServer::send_packet(peer, id, mesh, 0);
       peer.data.send(TransferEnd{id, TransferResult::complete, ErrorCode::none});
     },
     Failure::violation, "ended twice"},
    {"chunk_behind_the_end",
     [](auto& peer, auto id, auto mesh) {
       MockServer::send_packet(peer, id, mesh, 0);
       peer.data.send_chunk({id, 1, 0, 0, mesh.packets[0].size()}, proto::ByteView(mesh.packets[0]).first(10));
     },
     Failure::violation, "behind the end"},
    {"end_of_mesh_too_early",
     [](auto& peer, auto id, auto mesh) {
       open_right(peer, id, mesh);
       peer.data.send(TransferEnd{id, TransferResult::end_of_mesh, ErrorCode::none});
     },
     Failure::violation, "ended as end_of_mesh"},
    {"cancelled_unasked",
     [](auto& peer, auto id, auto mesh) {
       open_right(peer, id, mesh);
       peer.data.send(TransferEnd{id, TransferResult::cancelled, ErrorCode::none});
     },
     Failure::violation, "ended as cancelled"},
    {"error_behind_a_chunk",
     [](auto& peer, auto id, auto mesh) {
       peer.data.send_chunk({id, 1, 0, 0, mesh.packets[0].size()}, proto::ByteView(mesh.packets[0]).first(10));
       std::this_thread::sleep_for(50ms);
       peer.request.send(proto::ErrorMessage{id, ErrorCode::unavailable, ""});
     },
     Failure::violation, "behind a chunk"},
    {"opened_twice",
     [](auto& peer, auto id, auto mesh) {
       open_right(peer, id, mesh);
       open_right(peer, id, mesh);
     },
     Failure::violation, "did not ask for it"},
    {"damaged_packet",
     [](auto& peer, auto id, auto mesh) {
       open_right(peer, id, mesh);
       mesh.packets[0][60] ^= std::byte{1};
       MockServer::send_packet(peer, id, mesh, 0);
     },
     Failure::damaged, "packet 0 came damaged"},
    {"other_packet_of_same_size",
     [](auto& peer, auto id, auto mesh) {
       open_right(peer, id, mesh);
       proto::Bytes payload = mesh.packets[0];
       const auto honest = codec::parse_packet_header(payload);
       payload.erase(payload.begin(), payload.begin() + static_cast<std::ptrdiff_t>(honest->size));
       payload[12] ^= std::byte{1};
       codec::PacketHeader header;
       header.last = true;
       header.vertices = 10;
       header.faces = 20;
       header.generation = mesh.generation;
       mesh.packets[0] = codec::make_packet(header, payload);
       MockServer::send_packet(peer, id, mesh, 0);
     },
     Failure::damaged, "its checksum is not the directory's"},
    {"directory_garbage",
     [](auto& peer, auto id, auto mesh) {
       mesh.directory.back() ^= std::byte{1};
       open_right(peer, id, mesh);
     },
     Failure::violation, "level directory"},
    {"directory_longer",
     [](auto& peer, auto id, auto mesh) {
       mesh.directory.push_back(std::byte{0});
       open_right(peer, id, mesh);
     },
     Failure::violation, "bytes behind the level directory"},
    {"directory_of_another_generation",
     [](auto& peer, auto id, auto mesh) {
       ++mesh.generation;
       open_right(peer, id, mesh);
     },
     Failure::violation, "another generation"},
    {"client_frame_from_the_server", [](auto& peer, auto id, auto) { peer.request.send(proto::GetMeshList{id}); },
     Failure::violation, "get_mesh_list on the request channel"},
    {"data_frame_on_the_request_channel",
     [](auto& peer, auto id, auto) {
       peer.request.send(TransferEnd{id, TransferResult::complete, ErrorCode::none});
     },
     Failure::violation, "transfer_end on the request channel"},
    {"hello_ok_twice", [](auto& peer, auto, auto) { peer.request.send(proto::HelloOk{}); }, Failure::violation,
     "a second hello_ok"},
    {"frame_too_long", [](auto& peer, auto, auto) { peer.data.send_bytes(proto::Bytes(4, std::byte{0x7f})); },
     Failure::violation, "not pmcd's protocol"},
    {"session_refused",
     [](auto& peer, auto, auto) {
       peer.request.send(proto::ErrorMessage{0, ErrorCode::stalled, "too slow"});
     },
     Failure::refused, "too slow"},
};

INSTANTIATE_TEST_SUITE_P(All, WrongServer, ::testing::ValuesIn(all_wrongs),
                         [](const auto& wrong) { return std::string(wrong.param.name); });

}  // namespace
}  // namespace pmcd::client
