// SPDX-License-Identifier: MIT
// How many connections an address has, so that nobody takes all places. An IPv6 network of 64 bits counts as one
// address, because its owner has them all. Counting only: it closes nothing.
#pragma once

#include <cstddef>
#include <limits>
#include <unordered_map>

#include "daemon/net/asio.h"

namespace pmcd::net {

class AddressTable {
 public:
  /// What is counted together.
  class Key {
   public:
    explicit Key(const asio::ip::address& address);
    bool operator==(const Key&) const = default;
    [[nodiscard]] std::size_t hash() const;

   private:
    asio::ip::address_v6::bytes_type bytes_;
  };

  explicit AddressTable(std::size_t most = std::numeric_limits<std::size_t>::max()) : most_(most) {}

  /// Counts one more. False, and nothing is counted, if the address has as many as it may.
  bool enter(const Key& key);
  /// REQUIRES: an enter() of this key that was not left yet.
  void leave(const Key& key);
  [[nodiscard]] std::size_t count(const Key& key) const;
  [[nodiscard]] std::size_t addresses() const { return counts_.size(); }

 private:
  struct Hash {
    std::size_t operator()(const Key& key) const { return key.hash(); }
  };
  std::size_t most_;
  std::unordered_map<Key, std::size_t, Hash> counts_;
};

}  // namespace pmcd::net
