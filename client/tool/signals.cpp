// SPDX-License-Identifier: GPL-3.0-or-later
// A thread that reads signals from a descriptor: requesting a stop is not allowed in a signal handler.
#include "client/tool/signals.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <system_error>

namespace pmcd::tool {

StopOnSignal::StopOnSignal() : wake_(::eventfd(0, EFD_CLOEXEC)) {
  if (wake_ < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
  sigemptyset(&watched_);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction action {};
    ::sigaction(signal, nullptr, &action);
    if (action.sa_handler != SIG_IGN) sigaddset(&watched_, signal);
  }
  ::pthread_sigmask(SIG_BLOCK, &watched_, &before_);
  thread_ = std::thread([this] { watch(); });
}

StopOnSignal::~StopOnSignal() {
  const std::uint64_t one = 1;
  static_cast<void>(::write(wake_, &one, sizeof one));
  thread_.join();
  ::close(wake_);
  ::pthread_sigmask(SIG_SETMASK, &before_, nullptr);
}

void StopOnSignal::watch() {
  const int signals = ::signalfd(-1, &watched_, SFD_CLOEXEC);
  pollfd descriptors[] = {{wake_, POLLIN, 0}, {signals, POLLIN, 0}};
  for (;;) {
    if (::poll(descriptors, 2, -1) < 0 && errno != EINTR) break;
    if (descriptors[0].revents != 0) break;
    signalfd_siginfo info{};
    if (descriptors[1].revents == 0 || ::read(signals, &info, sizeof info) != sizeof info) continue;
    const int signal = static_cast<int>(info.ssi_signo);
    if (signal_ != 0) {  // asked twice: at once, by the signal's own way
      ::signal(signal, SIG_DFL);
      ::pthread_sigmask(SIG_UNBLOCK, &watched_, nullptr);
      ::raise(signal);
    }
    signal_ = signal;
    source_.request_stop();
  }
  ::close(signals);
}

std::string signal_name(int signal) {
  const char* name = ::sigabbrev_np(signal);
  return name == nullptr ? "signal " + std::to_string(signal) : std::string("SIG") + name;
}

}  // namespace pmcd::tool
