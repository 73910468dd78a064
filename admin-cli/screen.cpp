// SPDX-License-Identifier: GPL-3.0-or-later
// Escapes and signals. The handlers restore the terminal themselves, with calls that a handler may make, so that Ctrl-C
// is obeyed also while the program waits for a daemon that does not answer.
#include "admin-cli/screen.h"

#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <string>
#include <string_view>

#include "admin-cli/result.h"

namespace pmcd::admin {

namespace {

constexpr std::size_t kUsualColumns = 80;
constexpr std::size_t kUsualRows = 24;

// Alternate screen, no cursor, no wrapping of long lines; and back.
constexpr std::string_view kEnter = "\x1b[?1049h\x1b[?25l\x1b[?7l";
constexpr std::string_view kLeave = "\x1b[?7h\x1b[?25h\x1b[?1049l";

void put(std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(STDOUT_FILENO, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0 && errno == EAGAIN) {
      pollfd what{STDOUT_FILENO, POLLOUT, 0};
      ::poll(&what, 1, -1);
      continue;
    }
    if (written < 0) return;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
}

void end_well(int) {
  put(kLeave);
  ::_exit(kDone);
}

/// The signal was set to its default action when it came: raised again it ends the program as it should.
void end_by(int number) {
  put(kLeave);
  ::raise(number);
}

void stop(int) {
  const int kept = errno;
  put(kLeave);
  ::kill(::getpid(), SIGSTOP);
  put(kEnter);
  ::raise(SIGWINCH);  // what was drawn is gone
  errno = kept;
}

void wake(int) {}

void on(int number, void (*handler)(int), int flags) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = flags;
  ::sigaction(number, &action, nullptr);
}

}  // namespace

bool Screen::possible() {
  const char* terminal = std::getenv("TERM");
  return ::isatty(STDOUT_FILENO) == 1 && terminal != nullptr && std::string_view(terminal) != "dumb";
}

Screen::Screen() {
  constexpr int kOnce = static_cast<int>(SA_RESETHAND) | SA_NODEFER;
  on(SIGINT, end_well, 0);
  for (const int number : {SIGTERM, SIGHUP, SIGQUIT}) on(number, end_by, kOnce);
  on(SIGTSTP, stop, 0);
  on(SIGWINCH, wake, 0);
  // Only rest_until() lets it in: between a picture and the rest it would be lost.
  sigset_t window;
  ::sigemptyset(&window);
  ::sigaddset(&window, SIGWINCH);
  ::sigprocmask(SIG_BLOCK, &window, &mask_before_);
  mask_at_rest_ = mask_before_;
  ::sigdelset(&mask_at_rest_, SIGWINCH);
  put(kEnter);
}

Screen::~Screen() {
  put(kLeave);
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGTSTP, SIGWINCH}) on(number, SIG_DFL, 0);
  ::sigprocmask(SIG_SETMASK, &mask_before_, nullptr);
}

ScreenSize Screen::size() const {
  winsize size{};
  if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0 || size.ws_row == 0) {
    return {kUsualColumns, kUsualRows};
  }
  return {size.ws_col, size.ws_row};
}

void Screen::draw(const Lines& lines) const {
  // Each line is cleared behind its text, and at the end what is below: nothing is ever blank in between.
  std::string text = "\x1b[H";
  for (std::size_t i = 0; i < lines.size(); ++i) text += (i > 0 ? "\r\n" : "") + lines[i] + "\x1b[K";
  put(text + "\x1b[J");
}

bool Screen::rest_until(std::chrono::steady_clock::time_point end) const {
  for (;;) {
    const std::chrono::nanoseconds left = end - std::chrono::steady_clock::now();
    if (left.count() <= 0) return true;
    const auto seconds = std::chrono::floor<std::chrono::seconds>(left);
    const timespec limit{seconds.count(), (left - seconds).count()};
    if (::ppoll(nullptr, 0, &limit, &mask_at_rest_) < 0) return false;
  }
}

}  // namespace pmcd::admin
