// SPDX-License-Identifier: MIT
// The built daemon as a process of its own, on free ports, with database, socket and log in a folder of the test.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace pmcd::test {

/// Starts a program with stderr and stdout appended to `log`; `before_exec` runs in the child. Returns its process id.
pid_t start_program(const std::vector<std::string>& command, const std::string& log,
                    const std::function<void()>& before_exec = {});

/// Waits for the end of a process; its exit code, minus the signal that killed it, or -1000 if it had to be killed
/// because it did not end in time (a test failure).
int wait_for_end(pid_t process, int patience_ms = 20'000);

/// Runs a program to its end.
struct Ended {
  int code = 0;
  std::string output;
};
Ended run_program(const std::vector<std::string>& command, const std::string& folder);

std::string read_file(const std::string& path);

class DaemonProcess {
 public:
  /// Starts the daemon and waits until it listens; a failure fails the test. `extra`: more options.
  explicit DaemonProcess(const std::string& folder, std::vector<std::string> extra = {},
                         const std::function<void()>& before_exec = {});
  DaemonProcess(const DaemonProcess&) = delete;
  DaemonProcess& operator=(const DaemonProcess&) = delete;
  /// Kills it if it still runs.
  ~DaemonProcess();

  void signal(int number) const;
  /// Waits for its end, see wait_for_end.
  int wait();
  /// kill -9, at once.
  void kill();

  [[nodiscard]] pid_t id() const { return process_; }
  [[nodiscard]] std::uint16_t request_port() const { return request_port_; }
  [[nodiscard]] std::string admin_socket() const { return folder_ + "/admin.sock"; }
  [[nodiscard]] std::string database() const { return folder_ + "/meshes.db"; }
  [[nodiscard]] std::string log() const;

 private:
  std::string folder_;
  std::size_t log_start_ = 0;  ///< the log of an earlier run ends here
  pid_t process_ = 0;
  std::uint16_t request_port_ = 0;
};

}  // namespace pmcd::test
