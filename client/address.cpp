// SPDX-License-Identifier: MIT
// Reading and writing HOST[:PORT].
#include "client/address.h"

#include <charconv>

namespace pmcd::client {

namespace {

Error bad(std::string_view text, const std::string& what) {
  return {Failure::bad_address, proto::ErrorCode::none, "\"" + std::string(text) + "\" is no HOST[:PORT]: " + what};
}

}  // namespace

Result<Address> parse_address(std::string_view text) {
  Address address;
  std::string_view rest;
  if (text.starts_with('[')) {
    const std::size_t end = text.find(']');
    if (end == std::string_view::npos) return bad(text, "the bracket is not closed");
    address.host = text.substr(1, end - 1);
    rest = text.substr(end + 1);
    if (!rest.empty() && rest.front() != ':') return bad(text, "a colon and a port may follow the bracket");
  } else {
    const std::size_t colon = text.find(':');
    if (colon != std::string_view::npos && text.find(':', colon + 1) != std::string_view::npos) {
      return bad(text, "write an IPv6 address in brackets, for instance [::1]:7621");
    }
    address.host = text.substr(0, colon);
    rest = colon == std::string_view::npos ? std::string_view{} : text.substr(colon);
  }
  if (address.host.empty()) return bad(text, "the host is missing");
  if (rest.empty()) return address;
  rest.remove_prefix(1);
  unsigned port = 0;
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), port);
  if (error != std::errc{} || end != rest.data() + rest.size() || port == 0 || port > 65535) {
    return bad(text, "the port is a number from 1 to 65535");
  }
  address.port = static_cast<std::uint16_t>(port);
  return address;
}

std::string to_string(const Address& address) {
  const bool brackets = address.host.find(':') != std::string::npos;
  return (brackets ? "[" + address.host + "]" : address.host) + ":" + std::to_string(address.port);
}

}  // namespace pmcd::client
