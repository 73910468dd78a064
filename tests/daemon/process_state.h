// SPDX-License-Identifier: MIT
// What the kernel says of a process and of its TCP connections, read from /proc. Linux only, like the daemon.
#pragma once

#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/types.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>

#include "tests/sanitized.h"

namespace pmcd::test {

/// Memory of a process that is in RAM, in KiB; 0 if there is no such process.
inline std::size_t resident_kib(pid_t process) {
  std::ifstream status("/proc/" + std::to_string(process) + "/status");
  std::string word;
  std::size_t kib = 0;
  while (status >> word) {
    if (word == "VmRSS:") status >> kib;
  }
  return kib;
}

/// Descriptors that a process has open.
inline std::size_t open_descriptors(pid_t process) {
  const std::filesystem::directory_iterator all("/proc/" + std::to_string(process) + "/fd");
  return static_cast<std::size_t>(std::distance(begin(all), end(all)));
}

/// User and system time that a process has used, in ms.
inline long cpu_ms(pid_t process) {
  std::ifstream file("/proc/" + std::to_string(process) + "/stat");
  std::string line;
  std::getline(file, line);
  std::istringstream fields(line.substr(line.rfind(')') + 2));
  std::string skipped;
  for (int i = 0; i < 11; ++i) fields >> skipped;
  long user = 0;
  long system = 0;
  fields >> user >> system;
  return (user + system) * 1000 / ::sysconf(_SC_CLK_TCK);
}

/// Port of a TCP socket's own end, or (peer) of the other.
inline std::uint16_t port_of(int fd, bool peer = false) {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  auto* const raw = reinterpret_cast<sockaddr*>(&address);
  const int result = peer ? ::getpeername(fd, raw, &size) : ::getsockname(fd, raw, &size);
  return result == 0 ? ntohs(address.sin_port) : std::uint16_t{0};
}

/// Bytes that the kernel holds for sending at the `local` end of an IPv4 connection, whether a process has that end
/// open or not; 0 if there is no such connection any more.
inline unsigned long kernel_holds(std::uint16_t local, std::uint16_t remote) {
  std::ifstream table("/proc/net/tcp");
  std::string line;
  std::getline(table, line);
  while (std::getline(table, line)) {
    std::istringstream fields(line);
    std::string number;
    std::string ours;
    std::string theirs;
    std::string state;
    std::string queues;
    fields >> number >> ours >> theirs >> state >> queues;
    const auto port = [](const std::string& end) { return std::stoul(end.substr(end.find(':') + 1), nullptr, 16); };
    if (port(ours) == local && port(theirs) == remote) return std::stoul(queues, nullptr, 16);
  }
  return 0;
}

}  // namespace pmcd::test
