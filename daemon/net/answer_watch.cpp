// SPDX-License-Identifier: MIT
// One task for all sessions, which lives only while some are watched.
#include "daemon/net/answer_watch.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "daemon/net/on_exit.h"
#include "daemon/net/session.h"

namespace pmcd::net {

void AnswerWatch::add(std::weak_ptr<Session> session) {
  watched_.push_back(std::move(session));
  ++open_;
  if (watching_) return;
  watching_ = true;
  tasks_.spawn("answer watch", watch());
}

void AnswerWatch::closed() {
  if (--open_ == 0) wake_.notify();
}

awaitable<void> AnswerWatch::watch() {
  using std::chrono::milliseconds;
  const OnExit over([this] { watching_ = false; });
  const Duration tick = std::clamp<Duration>(limits_.stall / 8, milliseconds(5), milliseconds(250));
  while (open_ > 0) {
    co_await wake_.wait_until(Clock::now() + tick);
    look(Clock::now());
  }
  watched_.clear();
}

void AnswerWatch::look(Clock::time_point now) {
  std::vector<std::weak_ptr<Session>> looked_at = std::exchange(watched_, {});
  open_ = 0;
  for (std::weak_ptr<Session>& weak : looked_at) {
    const auto session = weak.lock();
    if (!session || session->closed()) continue;
    ++open_;  // as long as it may close itself
    if (session->owes_answers(now)) {
      watched_.push_back(std::move(weak));
    } else if (!session->closed()) {
      --open_;
    }
  }
}

}  // namespace pmcd::net
