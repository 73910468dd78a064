// SPDX-License-Identifier: MIT
// To linger where there is a place for it, else a farewell.
#include "daemon/net/refusals.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "daemon/net/farewell.h"
#include "daemon/net/on_exit.h"
#include "proto/text.h"

namespace pmcd::net {

Refusals::Refusals(TaskGroup& tasks, const Limits& limits, LogBudget& log)
    : tasks_(tasks), limits_(limits), log_(log), addresses_(std::max<std::size_t>(1, limits.turned_away / 4)) {}

void Refusals::turn_away(std::shared_ptr<Channel> channel, const AddressTable::Key& address, proto::ErrorCode code,
                         const std::string& text) {
  if (log_.take()) spdlog::info("connection refused: {}: {}", proto::code_name(code), text);
  proto::ErrorMessage message;
  message.code = code;
  message.text = proto::printable(text, proto::kMaxErrorTextBytes);
  proto::Bytes frame = proto::encode(message);
  if (lingering_ < limits_.turned_away && addresses_.enter(address)) {
    ++lingering_;
    channel->send(std::move(frame));
    tasks_.spawn("turn away", let_linger(std::move(channel), address));
  } else {
    say_farewell(channel->native_handle(), frame);
    channel->abort();
  }
}

awaitable<void> Refusals::let_linger(std::shared_ptr<Channel> channel, AddressTable::Key address) {
  const OnExit place([this, &address] {
    --lingering_;
    addresses_.leave(address);
  });
  co_await channel->finish();
}

}  // namespace pmcd::net
