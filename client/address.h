// SPDX-License-Identifier: MIT
// HOST[:PORT] as people write it. Looks nothing up.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "client/result.h"
#include "proto/messages.h"

namespace pmcd::client {

struct Address {
  std::string host;
  std::uint16_t port = proto::kDefaultRequestPort;  ///< of the request channel
  bool operator==(const Address&) const = default;
};

/// "host", "host:port", "[IPv6]" or "[IPv6]:port". Error: bad_address, with what is wrong.
Result<Address> parse_address(std::string_view text);

/// The same form back, with the port and with brackets where they are needed.
std::string to_string(const Address& address);

}  // namespace pmcd::client
