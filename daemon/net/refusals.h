// SPDX-License-Identifier: MIT
// Connections that cannot stay: each is told why. A few may linger until they have read it, for the others that is done
// in one go (farewell.h). Whom to refuse is the server's matter.
#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include "daemon/net/address_table.h"
#include "daemon/net/channel.h"
#include "daemon/net/limits.h"
#include "daemon/net/log_budget.h"
#include "daemon/net/task_group.h"
#include "proto/codes.h"

namespace pmcd::net {

class Refusals {
 public:
  /// At most limits.turned_away linger at a time, a quarter of them of one address.
  /// REQUIRES: all three outlive it, and it outlives the group's tasks.
  Refusals(TaskGroup& tasks, const Limits& limits, LogBudget& log);
  Refusals(const Refusals&) = delete;
  Refusals& operator=(const Refusals&) = delete;

  /// Sends an error with id 0 and closes the connection. REQUIRES: nothing else was sent on it.
  void turn_away(std::shared_ptr<Channel> channel, const AddressTable::Key& address, proto::ErrorCode code,
                 const std::string& text);

 private:
  awaitable<void> let_linger(std::shared_ptr<Channel> channel, AddressTable::Key address);

  TaskGroup& tasks_;
  const Limits& limits_;
  LogBudget& log_;
  std::size_t lingering_ = 0;
  AddressTable addresses_;  ///< of those
};

}  // namespace pmcd::net
