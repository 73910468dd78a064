// SPDX-License-Identifier: MIT
#include "tests/daemon/daemon_process.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <iterator>
#include <thread>

namespace pmcd::test {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

pid_t start_program(const std::vector<std::string>& command, const std::string& log,
                    const std::function<void()>& before_exec) {
  std::vector<char*> argv;
  for (const std::string& word : command) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  const pid_t process = ::fork();
  if (process != 0) return process;
  const int out = ::open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
  ::dup2(out, STDOUT_FILENO);
  ::dup2(out, STDERR_FILENO);
  if (before_exec) before_exec();
  ::execv(argv[0], argv.data());
  ::_exit(127);
}

int wait_for_end(pid_t process, int patience_ms) {
  const auto deadline = steady_clock::now() + milliseconds(patience_ms);
  int status = 0;
  while (::waitpid(process, &status, WNOHANG) == 0) {
    if (steady_clock::now() >= deadline) {
      ADD_FAILURE() << "process " << process << " did not end";
      ::kill(process, SIGKILL);
      ::waitpid(process, &status, 0);
      return -1000;
    }
    std::this_thread::sleep_for(milliseconds(2));
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

Ended run_program(const std::vector<std::string>& command, const std::string& folder) {
  const std::string log = folder + "/output";
  ::unlink(log.c_str());
  const int code = wait_for_end(start_program(command, log));
  return {code, read_file(log)};
}

std::string read_file(const std::string& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

DaemonProcess::DaemonProcess(const std::string& folder, std::vector<std::string> extra,
                             const std::function<void()>& before_exec)
    : folder_(folder), log_start_(read_file(folder + "/pmcd.log").size()) {
  std::vector<std::string> command = {
      PMCD_PROGRAM, "--database",  database(), "--admin-socket", admin_socket(), "--request-port",
      "0",          "--data-port", "0"};
  command.insert(command.end(), extra.begin(), extra.end());
  process_ = start_program(command, folder_ + "/pmcd.log", before_exec);
  const auto deadline = steady_clock::now() + std::chrono::seconds(20);
  const std::string marker = "request port ";
  while (steady_clock::now() < deadline) {
    const std::string text = log();
    const std::size_t at = text.find(marker);
    if (at != std::string::npos && text.find(", rule ") != std::string::npos) {
      request_port_ = static_cast<std::uint16_t>(std::stoul(text.substr(at + marker.size())));
      return;
    }
    int status = 0;
    if (::waitpid(process_, &status, WNOHANG) != 0) {
      process_ = 0;
      break;
    }
    std::this_thread::sleep_for(milliseconds(2));
  }
  ADD_FAILURE() << "the daemon did not start: " << log();
}

DaemonProcess::~DaemonProcess() {
  kill();
}

void DaemonProcess::signal(int number) const {
  if (process_ != 0) ::kill(process_, number);
}

int DaemonProcess::wait() {
  if (process_ == 0) return -1000;
  const int code = wait_for_end(process_);
  process_ = 0;
  return code;
}

void DaemonProcess::kill() {
  if (process_ == 0) return;
  ::kill(process_, SIGKILL);
  ::waitpid(process_, nullptr, 0);
  process_ = 0;
}

std::string DaemonProcess::log() const {
  const std::string all = read_file(folder_ + "/pmcd.log");
  return all.substr(std::min(log_start_, all.size()));
}

}  // namespace pmcd::test
