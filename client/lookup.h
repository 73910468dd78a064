// SPDX-License-Identifier: MIT
// Finding a host's addresses without ever being held up: the system's look-up cannot be stopped, so it runs on a thread
// that nobody waits for. Not part of the library's public face.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace pmcd::client {

using Endpoints = std::vector<boost::asio::ip::tcp::endpoint>;

class Lookup {
 public:
  /// Begins to look `host` up. A number (IPv4 or IPv6, with a zone or without) is answered at once. When the answer
  /// comes later, something is posted to `io`, so that it wakes. Looking up a name costs a thread until the system
  /// answers, also beyond this object's life; it then holds nothing but its own few bytes.
  Lookup(boost::asio::io_context& io, const std::string& host, std::uint16_t port);
  /// Waits for nothing.
  ~Lookup();
  Lookup(const Lookup&) = delete;
  Lookup& operator=(const Lookup&) = delete;

  [[nodiscard]] bool done() const;
  /// REQUIRES: done(). In the order of the system's preference; empty on failure.
  [[nodiscard]] Endpoints endpoints() const;
  /// REQUIRES: done(). Why there are none, in words; empty if there are some.
  [[nodiscard]] std::string failure() const;

 private:
  struct Answer;
  std::shared_ptr<Answer> answer_;
};

}  // namespace pmcd::client
