// SPDX-License-Identifier: GPL-3.0-or-later
// The command watch: rule, clients and queue again and again; a live view on a terminal, one snapshot after the other
// elsewhere.
#include <chrono>
#include <cstdint>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <variant>

#include "admin-cli/checks.h"
#include "admin-cli/commands.h"
#include "admin-cli/conversation.h"
#include "admin-cli/screen.h"
#include "admin-cli/watch_text.h"
#include "proto/admin_rules.h"

namespace pmcd::admin {

namespace {

using std::chrono::steady_clock;

struct WatchCommand {
  double interval_s = 1;
  std::uint64_t count = 0;  ///< snapshots; 0: without end
};

/// Over a connection of its own: the daemon closes one on which nothing comes for minutes, and whoever watches may look
/// that seldom, or be stopped by Ctrl-Z.
std::variant<Snapshot, Failure> take_snapshot(const std::string& socket) {
  auto opened = Conversation::open(socket);
  if (auto* failed = std::get_if<Failure>(&opened)) return std::move(*failed);
  auto& conversation = std::get<Conversation>(opened);
  auto rule = conversation.ask(proto::AdminRule{});
  if (auto* failed = std::get_if<Failure>(&rule)) return std::move(*failed);
  auto clients = conversation.ask(proto::AdminClients{});
  if (auto* failed = std::get_if<Failure>(&clients)) return std::move(*failed);
  auto queue = conversation.ask(proto::AdminQueue{});
  if (auto* failed = std::get_if<Failure>(&queue)) return std::move(*failed);
  return Snapshot{std::get<ordered_json>(std::move(rule)), std::get<ordered_json>(std::move(clients)),
                  std::get<ordered_json>(std::move(queue))};
}

/// Where there is no terminal: snapshots with a blank line between them, or a JSON document a line.
class Log {
 public:
  explicit Log(bool json) : json_(json) {}

  void print(const Snapshot& snapshot) {
    if (json_) {
      const ordered_json document{{"rule", snapshot.rule}, {"clients", snapshot.clients}, {"queue", snapshot.queue}};
      std::cout << document.dump(-1, ' ', false, ordered_json::error_handler_t::replace) << '\n';
    } else {
      if (!first_) std::cout << '\n';
      print_lines(snapshot_lines(snapshot, {}));
    }
    std::cout.flush();
    first_ = false;
  }

 private:
  bool json_;
  bool first_ = true;
};

void draw_until(const Screen& screen, const Snapshot& snapshot, steady_clock::time_point end) {
  do {
    screen.draw(snapshot_lines(snapshot, screen.size()));
  } while (!screen.rest_until(end));
}

/// Answers why it ended, or nothing after `count` snapshots.
std::optional<Failure> watch(const Common& common, const WatchCommand& command) {
  const auto interval =
      std::chrono::duration_cast<steady_clock::duration>(std::chrono::duration<double>(command.interval_s));
  Log log(common.json);
  std::optional<Screen> screen;  // the terminal stays as it is until there is something to show
  for (std::uint64_t number = 1;; ++number) {
    const auto next = steady_clock::now() + interval;
    const auto taken = take_snapshot(common.socket);
    if (const auto* failed = std::get_if<Failure>(&taken)) return *failed;
    const auto& snapshot = std::get<Snapshot>(taken);
    const bool last = number == command.count;
    if (last || common.json || !Screen::possible()) {
      screen.reset();  // and with it goes what it showed: the last look stays to be read
      log.print(snapshot);
      if (last || !std::cout) return std::nullopt;
      std::this_thread::sleep_until(next);
    } else {
      if (!screen) screen.emplace();
      draw_until(*screen, snapshot, next);
    }
  }
}

}  // namespace

void add_watch(CLI::App& app, const Common& common, int& exit_code) {
  CLI::App* sub = app.add_subcommand("watch", "Show rule, clients and queue live, until Ctrl-C");
  const auto command = std::make_shared<WatchCommand>();
  sub->add_option("--interval", command->interval_s, "Seconds from one look to the next, 0.1 to 3600")
      ->check(is_from_to(0.1, 3600, "0.1 to 3600"))
      ->capture_default_str()
      ->type_name("S");
  sub->add_option("--count", command->count, "End after this many; without it, never")
      ->check(is_number())
      ->type_name("N");
  sub->callback([command, &common, &exit_code] {
    const auto failed = watch(common, *command);  // the screen is left before anything is told
    exit_code = failed ? report(common, "watch", *failed) : kDone;
  });
}

}  // namespace pmcd::admin
