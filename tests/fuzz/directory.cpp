// SPDX-License-Identifier: MIT
// Level directories and whole .pmcd files. The checksum of the directory, which ends where its number of bytes says,
// is made right unless the first byte is odd. What is taken must come back from serialize, bit for bit.
#include "codec/packet/directory.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "codec/packet/bytes.h"
#include "codec/packet/crc32c.h"
#include "codec/packet/header.h"
#include "tests/fuzz/check.h"
#include "tests/fuzz/script.h"

namespace pmcd::fuzz {
namespace {

/// The size that the directory at the start of `file` claims; 0 if the file is shorter or it has no room for a
/// checksum.
std::size_t claimed_size(Input file) {
  constexpr std::size_t kSizeOffset = 5;
  if (file.size() < kSizeOffset) return 0;
  codec::ByteReader reader(file);
  reader.skip(kSizeOffset);
  const std::uint64_t rest = reader.read_varint();
  return reader.ok() && rest >= 4 && rest <= file.size() - reader.position() ? reader.position() + rest : 0;
}

void make_checksum_right(std::vector<std::byte>& file) {
  const std::size_t size = claimed_size(file);
  if (size == 0) return;
  const std::uint32_t sum = codec::crc32c(Input(file).first(size - 4));
  for (std::size_t i = 0; i < 4; ++i) file[size - 4 + i] = static_cast<std::byte>((sum >> (8 * i)) & 0xff);
}

}  // namespace

void directory(Input input) {
  Script script(input);
  const bool as_it_is = script.u8() % 2 == 1;
  const Input rest = script.rest();
  std::vector<std::byte> file(rest.begin(), rest.end());
  if (!as_it_is) make_checksum_right(file);

  const auto parsed = codec::parse_directory(file);
  const auto whole = codec::parse_file(file);
  check(parsed.ok() || !whole.ok(), "a file without a directory");
  if (!parsed) {
    check(!parsed.error().detail.empty(), "an error without a word");
    return;
  }
  check(parsed->size == claimed_size(file), "a directory of another size than it claims");
  check(!parsed->directory.levels.empty(), "a directory without a level");
  const std::vector<std::byte> again = codec::serialize(parsed->directory);
  check(again.size() == parsed->size && std::equal(again.begin(), again.end(), file.begin()),
        "a directory has two forms");
  for (const double value : parsed->directory.box_min) check(std::isfinite(value), "a box that is not finite");
  for (const double value : parsed->directory.box_max) check(std::isfinite(value), "a box that is not finite");

  if (!whole) return;
  check(whole->packets.size() == parsed->directory.levels.size(), "a file with more or fewer packets than levels");
  std::size_t at = parsed->size;
  for (std::size_t k = 0; k < whole->packets.size(); ++k) {
    const auto packet = whole->packets[k];
    check(packet.data() == file.data() + at && packet.size() == parsed->directory.levels[k].bytes,
          "packets that do not follow each other");
    check(codec::check_packet(packet).ok(), "a file with a damaged packet");
    at += packet.size();
  }
  check(at == file.size(), "a file with bytes behind its packets");
}

}  // namespace pmcd::fuzz
