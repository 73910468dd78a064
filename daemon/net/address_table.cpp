// SPDX-License-Identifier: MIT
// Addresses as 16 bytes: IPv4 in its mapped form, IPv6 without its lower half.
#include "daemon/net/address_table.h"

#include <algorithm>
#include <string_view>

namespace pmcd::net {

AddressTable::Key::Key(const asio::ip::address& address) : bytes_{} {
  if (address.is_v4()) {
    bytes_ = asio::ip::make_address_v6(asio::ip::v4_mapped, address.to_v4()).to_bytes();
  } else if (address.to_v6().is_v4_mapped()) {
    bytes_ = address.to_v6().to_bytes();
  } else {
    const auto bytes = address.to_v6().to_bytes();
    std::copy_n(bytes.begin(), bytes.size() / 2, bytes_.begin());
  }
}

std::size_t AddressTable::Key::hash() const {
  return std::hash<std::string_view>()({reinterpret_cast<const char*>(bytes_.data()), bytes_.size()});
}

bool AddressTable::enter(const Key& key) {
  std::size_t& count = counts_[key];
  if (count >= most_) return false;
  ++count;
  return true;
}

std::size_t AddressTable::count(const Key& key) const {
  const auto it = counts_.find(key);
  return it == counts_.end() ? 0 : it->second;
}

void AddressTable::leave(const Key& key) {
  const auto it = counts_.find(key);
  if (--it->second == 0) counts_.erase(it);
}

}  // namespace pmcd::net
