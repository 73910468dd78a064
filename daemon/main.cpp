// SPDX-License-Identifier: MIT
// pmcd: reads its configuration, opens the database, serves until SIGTERM or SIGINT, drains, ends.
// Exit codes: 0 ended in order, 1 could not start or not end in order, 2 usage or configuration.
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <systemd/sd-daemon.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <future>
#include <memory>
#include <new>
#include <string>
#include <utility>

#include "daemon/config.h"
#include "daemon/net/asio.h"
#include "daemon/net/descriptor_budget.h"
#include "daemon/net/server.h"
#include "daemon/scheduler/registry.h"
#include "daemon/store/database_lock.h"
#include "daemon/store/store_thread.h"
//
#include <boost/asio/detached.hpp>
#include <boost/asio/signal_set.hpp>

namespace pmcd {
namespace {

constexpr int kFailed = 1;
constexpr int kUsage = 2;

/// The level as journald understands it on stderr: "<6>" for info.
class Priority final : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&, spdlog::memory_buf_t& out) override {
    const char digit = message.level <= spdlog::level::debug  ? '7'
                       : message.level == spdlog::level::info ? '6'
                       : message.level == spdlog::level::warn ? '4'
                       : message.level == spdlog::level::err  ? '3'
                                                              : '2';
    out.push_back('<');
    out.push_back(digit);
    out.push_back('>');
  }
  [[nodiscard]] std::unique_ptr<custom_flag_formatter> clone() const override { return std::make_unique<Priority>(); }
};

void set_up_log(const std::string& level) {
  auto logger = spdlog::stderr_logger_mt("pmcd");
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  // The journal keeps time and priority itself.
  const bool journal = std::getenv("JOURNAL_STREAM") != nullptr;
  formatter->add_flag<Priority>('K').set_pattern(journal ? "%K%v" : "%Y-%m-%dT%H:%M:%S.%e%z %l: %v");
  logger->set_formatter(std::move(formatter));
  logger->set_level(spdlog::level::from_str(level));
  logger->flush_on(spdlog::level::trace);
  spdlog::set_default_logger(std::move(logger));
}

/// Raises the limit of descriptors as far as it goes and lowers `limits` to what it allows. False if it is too low.
bool respect_descriptors(net::Limits& limits) {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return true;
  limit.rlim_cur = limit.rlim_max;
  if (::setrlimit(RLIMIT_NOFILE, &limit) != 0) ::getrlimit(RLIMIT_NOFILE, &limit);
  const std::size_t descriptors = limit.rlim_cur;
  if (descriptors < net::kFewestDescriptors) {
    spdlog::critical("{} descriptors (RLIMIT_NOFILE) are too few: at least {} are needed, {} for {} sessions",
                     descriptors, net::kFewestDescriptors, net::descriptors_used(limits), limits.sessions);
    return false;
  }
  const net::Limits fit = net::fit_descriptors(limits, descriptors);
  if (fit.sessions < limits.sessions) {
    spdlog::warn("{} descriptors allow {} sessions, not {}", descriptors, fit.sessions, limits.sessions);
  }
  limits = fit;
  return true;
}

using Signals = net::asio::basic_signal_set<net::Executor>;

/// Waits for a signal, ends the server in order, and stops the loop. A second signal ends the process at once.
net::awaitable<void> end_on_signal(Signals& signals, net::Server& server, net::asio::io_context& io,
                                   net::Duration longest, bool& in_order) {
  net::error_code ignored;
  const int signal = co_await signals.async_wait(net::resume_with(ignored));
  spdlog::info("{}: ending", signal == SIGINT ? "SIGINT" : "SIGTERM");
  // However long the drain may take, systemd is to wait for it.
  const std::string stopping =
      "STOPPING=1\nSTATUS=draining: running transfers may end, nothing new begins\nEXTEND_TIMEOUT_USEC=" +
      std::to_string(std::chrono::ceil<std::chrono::microseconds>(longest).count());
  sd_notify(0, stopping.c_str());
  signals.async_wait([](const net::error_code& error, int) {
    if (error) return;
    spdlog::warn("a second signal: ending at once");
    std::_Exit(kFailed);
  });
  in_order = co_await server.drain();
  signals.cancel(ignored);
  io.stop();
}

/// A handler that runs out of memory ends what it was about; the loop goes on with the others.
void run_to_the_end(net::asio::io_context& io) {
  while (true) {
    try {
      io.run();
      return;
    } catch (const std::bad_alloc&) {
      spdlog::error("out of memory: something was left undone");
    }
  }
}

void report(const std::string& database, const store::Error& error) {
  spdlog::critical("database {}: {}: {}", database, store::error_name(error.code), error.detail);
}

std::unique_ptr<store::StoreThread> open_database(const std::string& path) {
  auto thread = store::StoreThread::start(path);
  if (!thread) {
    report(path, thread.error());
    return nullptr;
  }
  return std::move(thread).value();
}

/// What an operator has said last while a daemon ran; none, and a line in the log, if the database fails. Waits for the
/// database. Damage to the history is no reason to serve no meshes.
std::optional<store::LastChange> last_live_change(store::StoreThread& writer, const std::string& database) {
  using Answer = store::Result<store::LastChange>;
  const auto answer = std::make_shared<std::promise<Answer>>();
  writer.post([answer](store::MeshStore& store) { answer->set_value(store.rules().last()); });
  Answer last = answer->get_future().get();
  if (last) return std::move(last).value();
  const store::Error& error = last.error();
  if (error.code == store::ErrorCode::database_corrupt) {
    spdlog::warn("database {}: the history of the rule cannot be read, live changes are left out: {}", database,
                 error.detail);
    return store::LastChange();
  }
  report(database, error);
  return std::nullopt;
}

int serve(const Config& config) {
  // A peer that closes is an error of write(), not the end of the daemon; and so is a limit on file sizes.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  net::ServerOptions options;
  options.listen = config.listen;
  options.request_port = config.request_port;
  options.data_port = config.data_port;
  options.admin_socket = config.admin_socket;
  options.version = PMCD_VERSION;
  options.limits.sessions = config.max_sessions;
  options.limits.sessions_per_address = config.max_sessions_per_address;
  options.limits.hello = config.hello_timeout;
  options.limits.join = config.join_timeout;
  options.limits.stall = config.stall_timeout;
  options.limits.min_rate = config.min_rate;
  options.limits.drain = config.drain_timeout;
  options.limits.grace = config.grace_time;
  options.limits.cache_bytes = config.cache_bytes;
  if (!respect_descriptors(options.limits)) return kFailed;

  // For running transfers, then for what lingers or is being committed, and a margin.
  const net::Duration longest_end =
      2 * options.limits.drain + options.limits.linger + net::Duration(std::chrono::seconds(5));

  net::asio::io_context io(1);
  // From here on a signal waits for the loop: whoever was told that the daemon is ready may end it in order at once.
  Signals signals(io, SIGTERM, SIGINT);
  const auto lock = store::DatabaseLock::take(config.database);
  if (!lock) {
    report(config.database, lock.error());
    return kFailed;
  }
  // The writer first: it makes the tables that the reader expects.
  const auto writer = open_database(config.database);
  if (!writer) return kFailed;
  const auto reader = open_database(config.database);
  if (!reader) return kFailed;
  auto live = last_live_change(*writer, config.database);
  if (!live) return kFailed;
  net::PolicySources policy{config.command_line_policy, config.file_policy, *std::move(live)};
  net::Server server(io, *reader, *writer, std::move(policy), std::move(options));
  bool in_order = false;
  net::asio::co_spawn(io, end_on_signal(signals, server, io, longest_end, in_order), net::asio::detached);
  if (const auto error = server.start()) {
    spdlog::critical("{}", *error);
    return kFailed;
  }
  spdlog::info("pmcd {}: database {}, rule {}", PMCD_VERSION, config.database, scheduler::text_of(server.policy()));
  const std::string status = "READY=1\nSTATUS=serving on " + config.listen + ", request port " +
                             std::to_string(server.request_port()) + ", data port " +
                             std::to_string(server.data_port());
  sd_notify(0, status.c_str());
  run_to_the_end(io);
  if (!in_order) {
    // Something still runs in this server: its destructor must not pull the ground from under it.
    spdlog::error("not everything ended in time");
    std::_Exit(kFailed);
  }
  spdlog::info("ended");
  return 0;
}

}  // namespace
}  // namespace pmcd

int main(int argc, char** argv) try {
  const auto read = pmcd::read_config(argc, argv, PMCD_VERSION);
  if (const auto* answer = std::get_if<pmcd::ConfigAnswer>(&read)) {
    std::fputs(answer->text.c_str(), stdout);
    return 0;
  }
  if (const auto* error = std::get_if<pmcd::ConfigError>(&read)) {
    std::fprintf(stderr, "pmcd: %s\n", error->text.c_str());
    return pmcd::kUsage;
  }
  const auto& config = std::get<pmcd::Config>(read);
  if (config.check_only) {
    std::puts("the configuration is good");
    return 0;
  }
  pmcd::set_up_log(config.log_level);
  return pmcd::serve(config);
} catch (const std::exception& error) {
  std::fprintf(stderr, "pmcd: %s\n", error.what());
  return pmcd::kFailed;
}
