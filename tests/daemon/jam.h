// SPDX-License-Identifier: MIT
// A client that asks and asks and never reads, until everything between it and the server is full.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/socket.h>

#include <cerrno>
#include <chrono>
#include <cstddef>
#include <thread>

#include "tests/daemon/raw_client.h"

namespace pmcd::test {

/// Sends `frame` over and over until the other side has taken nothing for a while: all buffers on the way are full, and
/// the server waits for room before it reads on.
inline void jam(const RawConnection& connection, const proto::Bytes& frame) {
  ::fcntl(connection.fd(), F_SETFL, O_NONBLOCK);
  proto::Bytes block;
  for (int i = 0; i < 100; ++i) block.insert(block.end(), frame.begin(), frame.end());
  std::size_t sent = 0;
  auto last = std::chrono::steady_clock::now();
  while (std::chrono::steady_clock::now() - last < std::chrono::milliseconds(300)) {
    const std::size_t at = sent % block.size();
    const ssize_t count = ::send(connection.fd(), block.data() + at, block.size() - at, MSG_NOSIGNAL);
    if (count > 0) {
      sent += static_cast<std::size_t>(count);
      last = std::chrono::steady_clock::now();
    } else {
      ASSERT_EQ(errno, EAGAIN);
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }
}

}  // namespace pmcd::test
