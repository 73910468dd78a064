// SPDX-License-Identifier: MIT
// The samples themselves. Hex by hand: length, type, then the fields in the order of the document.
#include "tests/proto/samples.h"

namespace pmcd::proto::testing {

std::vector<Sample> all_samples() {
  std::vector<Sample> samples;
  samples.push_back(sample(Hello{{1, 0}, "pmctool"}, "12000000 0100 504d4344 0100 0000 07 706d63746f6f6c"));
  samples.push_back(sample(HelloOk{{1, 0}, counting_token(), 7622, 30, 8, "pmcd"},
                           "24000000 0200 504d4344 0100 0000 000102030405060708090a0b0c0d0e0f c61d 1e00 08 "
                           "04 706d6364"));
  samples.push_back(
      sample(ErrorMessage{5, ErrorCode::unknown_mesh, "no mesh"}, "11000000 0300 05000000 2300 0700 6e6f206d657368"));
  samples.push_back(sample(Ping{0xdeadbeef}, "06000000 0400 efbeadde"));
  samples.push_back(sample(Pong{0xdeadbeef}, "06000000 0500 efbeadde"));
  samples.push_back(sample(Goodbye{}, "02000000 0600"));
  samples.push_back(
      sample(Join{{1, 0}, counting_token()}, "1a000000 0700 504d4344 0100 0000 000102030405060708090a0b0c0d0e0f"));
  samples.push_back(sample(JoinOk{{1, 0}}, "0a000000 0800 504d4344 0100 0000"));
  samples.push_back(sample(GetMeshList{1, "bun", "a", 20}, "0e000000 1000 01000000 03 62756e 01 61 1400"));
  samples.push_back(sample(GetBaseMesh{2, "bunny"}, "0c000000 1100 02000000 05 62756e6e79"));
  samples.push_back(sample(GetNextPacket{3, 1}, "0a000000 1200 03000000 01000000"));
  samples.push_back(sample(GetPacket{4, 0x0123456789abcdef, 3, 258},
                           "1a000000 1300 04000000 efcdab8967452301 03000000 0201000000000000"));
  samples.push_back(sample(Cancel{4}, "06000000 1400 04000000"));
  samples.push_back(
      sample(Notice{NoticeKind::mesh_retired, 1, 600, "gone"}, "12000000 0900 0200 01000000 58020000 0400 676f6e65"));
  samples.push_back(sample(MeshOpened{2, 1, 0x0123456789abcdef, text_bytes("dir")},
                           "15000000 2000 02000000 01000000 efcdab8967452301 646972", true));
  samples.push_back({"chunk", chunk_frame({2, 1, 0, 4, 7}, text_bytes("abc")),
                     "21000000 3000 02000000 01000000 00000000 0400000000000000 0700000000000000 616263",
                     [](ByteView body) -> Result<Bytes> {
                       const auto chunk = decode_chunk(body);
                       if (!chunk) return chunk.error();
                       return chunk_frame(chunk->header, chunk->bytes);
                     },
                     false});
  samples.push_back(
      sample(TransferEnd{2, TransferResult::failed, ErrorCode::unavailable}, "09000000 3100 02000000 02 4000"));

  samples.push_back(sample(AdminHello{{1, 0}, "pmcctl"}, "11000000 0101 504d4341 0100 0000 06 706d6363746c"));
  samples.push_back(sample(AdminHelloOk{{1, 0}, "pmcd"}, "0f000000 0201 504d4341 0100 0000 04 706d6364"));
  samples.push_back(sample(AdminList{1}, "06000000 1001 01000000"));
  samples.push_back(sample(AdminShow{2, "a"}, "08000000 1101 02000000 01 61"));
  samples.push_back(sample(AdminRemove{3, "a"}, "08000000 1201 03000000 01 61"));
  samples.push_back(sample(AdminStatus{4}, "06000000 1301 04000000"));
  samples.push_back(
      sample(IngestBegin{5, true, "a", text_bytes("dir")}, "0c000000 2001 05000000 01 01 61 646972", true));
  samples.push_back(sample(IngestReady{5}, "06000000 2101 05000000"));
  samples.push_back({"ingest_data", ingest_data_frame({5, 1, 256}, text_bytes("xy")),
                     "14000000 2201 05000000 01000000 0001000000000000 7879",
                     [](ByteView body) -> Result<Bytes> {
                       const auto data = decode_ingest_data(body);
                       if (!data) return data.error();
                       return ingest_data_frame(data->header, data->bytes);
                     },
                     true});
  samples.push_back(sample(IngestCommit{5}, "06000000 2301 05000000"));
  samples.push_back(sample(IngestOk{5, 0x0123456789abcdef, true}, "0f000000 2401 05000000 efcdab8967452301 01"));
  samples.push_back(sample(AdminAnswer{2, true, "{}"}, "09000000 3001 02000000 01 7b7d", true));

  samples.push_back(sample(AdminRules{1}, "06000000 4001 01000000"));
  samples.push_back(sample(AdminRule{2}, "06000000 4101 02000000"));
  samples.push_back(sample(AdminSetRule{3, {true, 258}, "fcsf", {{"burst", "2"}, {"slots", ""}}},
                           "24000000 4201 03000000 03 0201000000000000 04 66637366 02 05 6275727374 01 32 "
                           "05 736c6f7473 00"));
  samples.push_back(sample(AdminHistory{4, 20}, "0a000000 4301 04000000 14000000"));
  samples.push_back(
      sample(AdminRevert{5, {false, 0}, 7}, "17000000 4401 05000000 02 0000000000000000 0700000000000000"));
  samples.push_back(sample(AdminQueue{6}, "06000000 4501 06000000"));
  samples.push_back(sample(AdminClients{7}, "06000000 4601 07000000"));
  samples.push_back(sample(AdminExplain{8, 0x0123456789abcdef}, "0e000000 4701 08000000 efcdab8967452301"));
  samples.push_back(sample(AdminWeight{9, 17, 1500}, "12000000 4801 09000000 1100000000000000 dc050000"));
  return samples;
}

}  // namespace pmcd::proto::testing
