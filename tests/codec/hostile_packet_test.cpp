// SPDX-License-Identifier: MIT
// Packets cut, damaged, out of place or forged: an error by name, the decoder stands where it stood and takes the right
// packet afterwards, and memory stays within its limits.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "codec/decoder.h"
#include "codec/encoder.h"
#include "tests/codec/allocations.h"
#include "tests/codec/forgery.h"
#include "tests/codec/generated.h"
#include "tests/codec/support.h"
#include "tests/sanitized.h"

namespace pmcd::codec::testing {
namespace {

using Bytes = std::vector<std::byte>;

std::vector<EncodedPacket> packets_of(const TriangleMesh& mesh, std::optional<unsigned> bits) {
  EncodeOptions options;
  options.bits = bits;
  Result<Encoded> encoded = encode(mesh, options);
  EXPECT_TRUE(encoded.ok());
  return encoded ? std::move(encoded).value().packets : std::vector<EncodedPacket>();
}

TriangleMesh awkward_mesh() {
  Random random(21);
  TriangleMesh mesh = joined(joined(sphere(2), grid(7, 7, 2)), tetrahedron());
  split_faces(mesh, 20, random);
  jitter(mesh, 0.02, random);
  add_isolated(mesh, 6, random);
  return mesh;
}

// Small enough for every flip of every bit to be decoded, with all that a packet can hold.
const std::vector<std::vector<EncodedPacket>>& samples() {
  static const std::vector<std::vector<EncodedPacket>> all = {packets_of(awkward_mesh(), 10),
                                                              packets_of(awkward_mesh(), std::nullopt)};
  return all;
}

std::size_t header_bytes(const EncodedPacket& packet) {
  const Result<PacketHeader> header = parse_packet_header(packet.bytes);
  EXPECT_TRUE(header.ok());
  return header ? header->size : packet.bytes.size();
}

// Each packet in turn, before it is applied: `attack(decoder, k)` with the decoder at level k - 1, then the right
// packet.
template <typename Attack>
void at_each_level(const std::vector<EncodedPacket>& packets, const DecoderLimits& limits, Attack attack) {
  Decoder decoder(limits);
  for (std::size_t k = 0; k < packets.size(); ++k) {
    const TriangleMesh before = k > 0 ? decoder.mesh() : TriangleMesh();
    attack(decoder, k);
    ASSERT_EQ(decoder.has_level(), k > 0);
    if (k > 0) {
      EXPECT_EQ(decoder.level().level, k - 1);
      const TriangleMesh after = decoder.mesh();
      EXPECT_TRUE(before.faces == after.faces && before.positions == after.positions);
    }
    const Result<Level> level = decoder.apply(packets[k].bytes);
    ASSERT_TRUE(level.ok()) << "the right packet " << k << " afterwards: " << text(level.error());
  }
}

TEST(HostilePackets, EveryPrefixIsTruncatedAndOneByteMoreIsTrailing) {
  for (const auto& packets : samples()) {
    at_each_level(packets, {}, [&](Decoder& decoder, std::size_t k) {
      const Bytes& bytes = packets[k].bytes;
      for (std::size_t length = 0; length < bytes.size(); ++length) {
        const Bytes cut(bytes.begin(),
                        bytes.begin() + static_cast<std::ptrdiff_t>(length));  // so that ASan sees its end
        const Result<Level> level = decoder.apply(cut);
        ASSERT_FALSE(level.ok());
        ASSERT_EQ(level.error().code, ErrorCode::truncated) << text(level.error());
        ASSERT_EQ(level.error().where, length);
      }
      for (unsigned extra : {0u, 1u, 0xFFu}) {
        Bytes longer = bytes;
        longer.push_back(static_cast<std::byte>(extra));
        const Result<Level> level = decoder.apply(longer);
        ASSERT_FALSE(level.ok());
        EXPECT_EQ(level.error().code, ErrorCode::trailing_bytes);
        EXPECT_EQ(level.error().where, bytes.size());
      }
    });
  }
}

// All positions up to 8 KiB, 2,000 seeded ones above.
std::vector<std::size_t> positions_to_flip(std::size_t size, Random& random) {
  std::vector<std::size_t> positions;
  constexpr std::size_t kAll = 8192;
  for (std::size_t i = 0; i < std::min(size, kAll); ++i) positions.push_back(i);
  if (size > kAll) {
    for (int i = 0; i < 2000; ++i) positions.push_back(kAll + random.bits() % (size - kAll));
  }
  return positions;
}

void expect_flips_refused(const std::vector<EncodedPacket>& packets) {
  Random random(5);
  const std::set<ErrorCode> names = {
      ErrorCode::bad_magic, ErrorCode::unsupported_version, ErrorCode::unsupported_feature, ErrorCode::corrupt_data,
      ErrorCode::truncated, ErrorCode::trailing_bytes,      ErrorCode::checksum_mismatch};
  at_each_level(packets, {}, [&](Decoder& decoder, std::size_t k) {
    for (std::size_t at : positions_to_flip(packets[k].bytes.size(), random)) {
      Bytes damaged = packets[k].bytes;
      damaged[at] ^= static_cast<std::byte>(1 + random.below(255));
      const Result<Level> level = decoder.apply(damaged);
      ASSERT_FALSE(level.ok()) << "packet " << k << " byte " << at;
      ASSERT_EQ(names.count(level.error().code), 1u) << text(level.error());
      if (at >= header_bytes(packets[k]) || (at >= kHeaderChecksumOffset && at < kHeaderNumbersOffset)) {
        ASSERT_EQ(level.error().code, ErrorCode::checksum_mismatch);
      }
      ASSERT_FALSE(level.error().detail.empty());
    }
  });
}

TEST(HostilePackets, EveryFlippedByteIsRefused) {
  for (const auto& packets : samples()) expect_flips_refused(packets);
}

TEST(HostilePackets, FlippedBytesOfLargePacketsAreRefused) {
  Random random(1);
  TriangleMesh mesh = sphere(5);
  jitter(mesh, 0.02, random);
  const std::vector<EncodedPacket> packets = packets_of(mesh, std::nullopt);
  ASSERT_GT(packets.back().bytes.size(), 8192u);
  expect_flips_refused(packets);
}

TEST(HostilePackets, OutOfOrder) {
  for (const auto& packets : samples()) {
    at_each_level(packets, {}, [&](Decoder& decoder, std::size_t k) {
      for (std::size_t other = 0; other < packets.size(); ++other) {
        if (other == k) continue;
        const Result<Level> level = decoder.apply(packets[other].bytes);
        ASSERT_FALSE(level.ok());
        EXPECT_EQ(level.error().code, ErrorCode::out_of_order) << text(level.error());
        EXPECT_EQ(level.error().where, other);
      }
    });
    Decoder complete;
    for (const EncodedPacket& packet : packets) ASSERT_TRUE(complete.apply(packet.bytes).ok());
    for (const EncodedPacket& packet : packets) {
      const Result<Level> level = complete.apply(packet.bytes);
      ASSERT_FALSE(level.ok());
      EXPECT_EQ(level.error().code, ErrorCode::out_of_order);
    }
    EXPECT_TRUE(complete.level().last);
  }
}

TEST(HostilePackets, OfAnotherMeshOrAnotherEncoding) {
  const auto& packets = samples()[0];
  const std::vector<EncodedPacket> other_mesh = packets_of(torus(20, 20), 10);
  const std::vector<EncodedPacket> other_bits = packets_of(awkward_mesh(), 11);
  at_each_level(packets, {}, [&](Decoder& decoder, std::size_t k) {
    if (k == 0) return;
    for (const auto* other : {&other_mesh, &other_bits, &samples()[1]}) {
      ASSERT_GT(other->size(), k);
      const Result<Level> level = decoder.apply((*other)[k].bytes);
      ASSERT_FALSE(level.ok());
      EXPECT_EQ(level.error().code, ErrorCode::wrong_mesh) << text(level.error());
    }
  });
}

TEST(HostilePackets, OfAnotherFormatVersion) {
  const auto& packets = samples()[0];
  at_each_level(packets, {}, [&](Decoder& decoder, std::size_t k) {
    for (unsigned version : {1u, 2u, 15u}) {
      Bytes other = packets[k].bytes;
      other[1] ^= static_cast<std::byte>(version << 4);
      const Result<Level> level = decoder.apply(with_right_checksum(other));
      ASSERT_FALSE(level.ok());
      EXPECT_EQ(level.error().code, ErrorCode::unsupported_version);
      EXPECT_EQ(level.error().where, kFormatVersion ^ version);
    }
  });
}

// At the start of packet 0's payload, for float32.
constexpr std::size_t kLatticeBytes = 18;

// What a forged packet may end in: any error, or the very level that the honest packet gives.
struct Outcomes {
  std::size_t accepted = 0;
  std::set<ErrorCode> errors;
};

void expect_harmless(const Bytes& forged, const TriangleMesh& honest, const DecoderLimits& limits,
                     const std::vector<EncodedPacket>& packets, std::size_t k, Outcomes& outcomes) {
  Decoder decoder(limits);
  for (std::size_t i = 0; i < k; ++i) ASSERT_TRUE(decoder.apply(packets[i].bytes).ok());
  const AllocationMeter meter;
  const Result<Level> level = decoder.apply(forged);
  ASSERT_LT(meter.peak(), 2u << 20);
  if (!level) {
    outcomes.errors.insert(level.error().code);
    ASSERT_NE(level.error().code, ErrorCode::internal_error);
    return;
  }
  ++outcomes.accepted;
  const TriangleMesh mesh = decoder.mesh();
  ASSERT_TRUE(mesh.faces == honest.faces && mesh.positions == honest.positions) << "accepted as another mesh";
}

TEST(HostilePackets, FlippedBitsBehindARightChecksumNeverMakeAnotherMesh) {
  DecoderLimits limits;
  limits.max_vertices = 2000;
  limits.max_faces = 4000;
  for (const auto& packets : samples()) {
    Outcomes outcomes;
    for (std::size_t k = 0; k < packets.size(); ++k) {
      Decoder honest;
      for (std::size_t i = 0; i <= k; ++i) ASSERT_TRUE(honest.apply(packets[i].bytes).ok());
      const TriangleMesh right = honest.mesh();
      const Bytes& bytes = packets[k].bytes;
      const std::size_t payload_at = header_bytes(packets[k]);
      const std::size_t stride = bytes.size() > 600 ? 5 : 1;
      const std::size_t in_payload = test::kSanitized ? 3 * stride : stride;
      for (std::size_t bit = 0; bit < 8 * bytes.size(); bit += bit < 8 * payload_at ? stride : in_payload) {
        // The lattice has a test of its own, below.
        if (k == 0 && bit / 8 >= payload_at && bit / 8 < payload_at + kLatticeBytes) continue;
        if (bit / 8 >= kHeaderChecksumOffset && bit / 8 < kHeaderNumbersOffset) continue;  // the checksum itself
        Bytes forged = bytes;
        forged[bit / 8] ^= static_cast<std::byte>(1u << (bit % 8));
        const auto accepted_before = outcomes.accepted;
        expect_harmless(with_right_checksum(forged), right, limits, packets, k, outcomes);
        if (HasFatalFailure()) FAIL() << "packet " << k << " bit " << bit;
        // No level depends on the generation of packet 0, which ends its header, nor on the last bits of a stream.
        const bool of_generation = k == 0 && bit / 8 < payload_at && bit / 8 + 8 >= payload_at;
        EXPECT_TRUE(outcomes.accepted == accepted_before || of_generation || bit / 8 + 1 == bytes.size())
            << "packet " << k << " bit " << bit << " does not matter";
      }
    }
    EXPECT_EQ(outcomes.errors.count(ErrorCode::hash_mismatch), 1u);
    EXPECT_EQ(outcomes.errors.count(ErrorCode::corrupt_data), 1u);
    EXPECT_EQ(outcomes.errors.count(ErrorCode::limit_exceeded), 1u);
    EXPECT_EQ(outcomes.errors.count(ErrorCode::checksum_mismatch), 0u);
    // Only what no level depends on: the generation of packet 0, `last`, the last bits of a stream.
    EXPECT_LE(outcomes.accepted, 64 + 8 * packets.size());
  }
}

TEST(HostilePackets, AnotherLatticeBehindARightChecksumIsAnotherMesh) {
  for (const auto& packets : samples()) {
    Decoder honest;
    ASSERT_TRUE(honest.apply(packets[0].bytes).ok());
    const std::size_t payload_at = header_bytes(packets[0]);
    for (std::size_t bit = 8 * payload_at; bit < 8 * (payload_at + kLatticeBytes); ++bit) {
      Bytes forged = packets[0].bytes;
      forged[bit / 8] ^= static_cast<std::byte>(1u << (bit % 8));
      Outcomes outcomes;
      expect_harmless(with_right_checksum(forged), honest.mesh(), {}, packets, 0, outcomes);
      ASSERT_EQ(outcomes.accepted, 0u) << "bit " << bit;
    }
  }
}

TEST(HostilePackets, RandomPayloadsBehindARightChecksum) {
  DecoderLimits limits;
  limits.max_vertices = 2000;
  limits.max_faces = 4000;
  Random random(99);
  for (const auto& packets : samples()) {
    Outcomes outcomes;
    for (std::size_t k = 0; k < packets.size(); ++k) {
      Decoder honest;
      for (std::size_t i = 0; i <= k; ++i) ASSERT_TRUE(honest.apply(packets[i].bytes).ok());
      const TriangleMesh right = honest.mesh();
      for (unsigned run = 0; run < test::rounds(1200); ++run) {
        const std::size_t payload_at = header_bytes(packets[k]);
        PacketHeader header = *parse_packet_header(packets[k].bytes);
        Bytes forged(packets[k].bytes.begin() + static_cast<std::ptrdiff_t>(payload_at), packets[k].bytes.end());
        // Behind the lattice, which has tests of its own; some keep an honest beginning.
        const std::size_t fixed = k == 0 ? kLatticeBytes : 0;
        const std::size_t kept = fixed + (random.one_in(2) ? 0 : random.below(forged.size() - fixed));
        const unsigned style = random.below(4);
        for (std::size_t i = kept; i < forged.size(); ++i) {
          const auto any = static_cast<std::byte>(random.below(256));
          forged[i] = style == 0
                          ? std::byte{0}
                          : (style == 1 ? std::byte{0xFF}
                                        : (style == 2 ? any : forged[i] ^ (random.one_in(20) ? any : std::byte{0})));
        }
        if (random.one_in(3)) forged.resize(kept + random.below(forged.size() - kept + 1));
        if (random.one_in(3)) {  // other counts, within the limits
          header.vertices = random.below(2000);
          header.faces = random.below(2000);
        }
        expect_harmless(forged_packet(header, forged), right, limits, packets, k, outcomes);
        if (HasFatalFailure()) FAIL() << "packet " << k << " run " << run;
      }
    }
    EXPECT_EQ(outcomes.errors.count(ErrorCode::corrupt_data), 1u);
  }
}

TEST(HostilePackets, PayloadLongerThanItsContentIsCorrupt) {
  for (const auto& packets : samples()) {
    at_each_level(packets, {}, [&](Decoder& decoder, std::size_t k) {
      for (std::size_t extra : {9u, 10u, 100u, 5000u}) {  // more than the range decoder reads ahead
        const Result<PacketHeader> header = parse_packet_header(packets[k].bytes);
        ASSERT_TRUE(header.ok());
        Bytes payload(packets[k].bytes.begin() + static_cast<std::ptrdiff_t>(header->size), packets[k].bytes.end());
        payload.insert(payload.end(), extra, std::byte{0});
        const Result<Level> level = decoder.apply(forged_packet(*header, payload));
        ASSERT_FALSE(level.ok()) << "packet " << k << ", " << extra << " bytes more";
        EXPECT_EQ(level.error().code, ErrorCode::corrupt_data) << text(level.error());
      }
    });
  }
}

Result<Level> apply_to_fresh(const Bytes& packet, const DecoderLimits& limits, std::size_t& peak) {
  Decoder decoder(limits);
  const AllocationMeter meter;
  Result<Level> level = decoder.apply(packet);
  peak = meter.peak();
  return level;
}

TEST(HostileClaims, BeyondTheLimitsAreRefusedBeforeAnythingIsAllocated) {
  DecoderLimits limits;
  limits.max_vertices = 1000;
  limits.max_faces = 2000;
  limits.max_packet_bytes = 4096;
  const Bytes payload = base_payload([](RangeEncoder& encoder) { write_count(encoder, 1); });
  struct Claim {
    std::uint32_t vertices;
    std::uint32_t faces;
    std::uint64_t where;
  };
  for (const Claim& claim : {Claim{1001, 4, 1001}, Claim{0xFFFFFFFFu, 4, 0xFFFFFFFFu}, Claim{4, 2001, 2001},
                             Claim{4, 0xFFFFFFFFu, 0xFFFFFFFFu}, Claim{0x80000000u, 0x80000000u, 0x80000000u}}) {
    PacketHeader header;
    header.vertices = claim.vertices;
    header.faces = claim.faces;
    std::size_t peak = 0;
    const Result<Level> level = apply_to_fresh(forged_packet(header, payload), limits, peak);
    ASSERT_FALSE(level.ok());
    EXPECT_EQ(level.error().code, ErrorCode::limit_exceeded) << text(level.error());
    EXPECT_EQ(level.error().where, claim.where);
    EXPECT_LT(peak, 2048u);
  }
  PacketHeader header;
  header.vertices = 4;
  header.faces = 4;
  std::size_t peak = 0;
  const Bytes longer = forged_packet(header, Bytes(5000));
  const Result<Level> level = apply_to_fresh(longer, limits, peak);
  ASSERT_FALSE(level.ok());
  EXPECT_EQ(level.error().code, ErrorCode::limit_exceeded);
  EXPECT_EQ(level.error().where, longer.size());
  EXPECT_LT(peak, 2048u);
}

TEST(HostileClaims, LimitsHoldForEveryPacketNotOnlyTheFirst) {
  const auto& packets = samples()[0];
  ASSERT_GE(packets.size(), 3u);
  DecoderLimits limits;
  limits.max_vertices = packets[1].vertices;
  Decoder decoder(limits);
  ASSERT_TRUE(decoder.apply(packets[0].bytes).ok());
  ASSERT_TRUE(decoder.apply(packets[1].bytes).ok());
  const Result<Level> level = decoder.apply(packets[2].bytes);
  ASSERT_FALSE(level.ok());
  EXPECT_EQ(level.error().code, ErrorCode::limit_exceeded);
  EXPECT_EQ(level.error().where, packets[2].vertices);
  EXPECT_EQ(decoder.level().level, 1u);
}

TEST(HostileClaims, StructureThatNobodyKnowsIsCorrupt) {
  PacketHeader header;
  header.last = true;
  auto code_of = [&](std::uint32_t structure) {
    const Bytes payload = base_payload(
        [](RangeEncoder& encoder) {
          write_count(encoder, 0);  // no component
          encoder.raw(0, 2);        // no isolated vertices, no exactness
        },
        static_cast<Structure>(structure));
    Decoder decoder;
    const Result<Level> level = decoder.apply(forged_packet(header, payload));
    EXPECT_FALSE(level.ok());
    return level.ok() ? ErrorCode::internal_error : level.error().code;
  };
  for (std::uint32_t known = 0; known < 3; ++known) EXPECT_EQ(code_of(known), ErrorCode::hash_mismatch) << known;
  EXPECT_EQ(code_of(3), ErrorCode::corrupt_data);
}

TEST(HostileClaims, LargeClaimsOfAFewBytesCostLittleMemory) {
  // Within the default limits, so nothing but the content can refuse them.
  PacketHeader header;
  header.vertices = 99'000'000;
  header.faces = 190'000'000;
  std::vector<Bytes> payloads;
  payloads.push_back(base_payload([](RangeEncoder& encoder) { write_count(encoder, 180'000'000); }));  // components
  payloads.push_back(base_payload([](RangeEncoder& encoder) {
    write_count(encoder, 0);      // no component
    encoder.raw(1, 1);            // isolated vertices:
    encoder.raw(98'000'000, 32);  // so many
  }));
  payloads.push_back(base_payload([](RangeEncoder&) {}));
  payloads.push_back(Bytes(22, std::byte{0xFF}));
  for (const Bytes& payload : payloads) {
    std::size_t peak = 0;
    const Result<Level> level = apply_to_fresh(forged_packet(header, payload), {}, peak);
    ASSERT_FALSE(level.ok());
    EXPECT_LT(peak, 4u << 20) << text(level.error());
  }
}

void expect_false_counts_refused(const std::vector<EncodedPacket>& packets) {
  for (std::size_t k = 0; k < packets.size(); ++k) {
    const Result<PacketHeader> honest = parse_packet_header(packets[k].bytes);
    ASSERT_TRUE(honest.ok());
    const auto payload = std::span<const std::byte>(packets[k].bytes).subspan(honest->size);
    for (const std::int64_t off : {-1, 1, 2, 1000}) {
      for (const bool vertices : {false, true}) {
        PacketHeader header = *honest;
        std::uint32_t& count = vertices ? header.vertices : header.faces;
        count = static_cast<std::uint32_t>(count + off);
        Decoder decoder;
        for (std::size_t i = 0; i < k; ++i) ASSERT_TRUE(decoder.apply(packets[i].bytes).ok());
        const Result<Level> level = decoder.apply(forged_packet(header, payload));
        ASSERT_FALSE(level.ok());
        EXPECT_EQ(level.error().code, ErrorCode::corrupt_data) << text(level.error());
        // Too few promised: refused on the way, not when all of it stands in memory (where = the counts in the header).
        if (off < 0) {
          EXPECT_NE(level.error().where, kHeaderNumbersOffset) << text(level.error());
        }
      }
    }
  }
}

TEST(HostileClaims, CountsThatTheContentDoesNotKeep) {
  expect_false_counts_refused(samples()[0]);
  expect_false_counts_refused(packets_of(torus(12, 10), 10));  // no ear passes, no isolated vertices
}

}  // namespace
}  // namespace pmcd::codec::testing
