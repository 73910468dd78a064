// SPDX-License-Identifier: MIT
// Values judged, and put together from command line, file and defaults.
#include "daemon/config.h"

#include <arpa/inet.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/config_text.h"

namespace pmcd {
namespace {

constexpr std::array kLogLevels = {"trace", "debug", "info", "warn", "error", "critical", "off"};

std::string joined(const std::vector<std::string_view>& words) {
  std::string text;
  for (const std::string_view word : words) text += (text.empty() ? "" : ", ") + std::string(word);
  return text;
}

/// Takes values out of what was given, checks them, and remembers the first complaint.
class Taker {
 public:
  explicit Taker(const GivenValues& values) : values_(values) {}

  void text(const char* name, std::string& into) {
    const Given* given = find(name);
    if (given == nullptr) return;
    if (given->value.empty()) {
      complain(*given, "must not be empty");
    } else {
      into = given->value;
    }
  }

  template <typename Number>
  void number(const char* name, Number least, Number most, Number& into) {
    const Given* given = find(name);
    if (given == nullptr) return;
    Number value{};
    const char* const end = given->value.data() + given->value.size();
    const auto [stop, error] = std::from_chars(given->value.data(), end, value);
    if (error != std::errc() || stop != end || value < least || value > most) {
      complain(*given, "must be a number from " + std::to_string(least) + " to " + std::to_string(most));
    } else {
      into = value;
    }
  }

  /// Seconds, with up to three decimals.
  void seconds(const char* name, std::chrono::milliseconds most, std::chrono::milliseconds& into) {
    const Given* given = find(name);
    if (given == nullptr) return;
    double value = 0;
    const char* const end = given->value.data() + given->value.size();
    const auto [stop, error] = std::from_chars(given->value.data(), end, value, std::chars_format::fixed);
    const auto least_s = std::chrono::duration<double>(kMinTime).count();
    const auto most_s = std::chrono::duration<double>(most).count();
    if (error != std::errc() || stop != end || !(value >= least_s && value <= most_s)) {
      std::ostringstream range;
      range << "must be a number of seconds from " << least_s << " to " << most_s;
      complain(*given, range.str());
    } else {
      into = std::chrono::milliseconds(std::llround(value * 1000));
    }
  }

  /// Bytes, with K, M or G (powers of 1024) behind the number.
  void bytes(const char* name, std::uint64_t most, std::uint64_t& into) {
    const Given* given = find(name);
    if (given == nullptr) return;
    std::uint64_t value = 0;
    const char* const end = given->value.data() + given->value.size();
    const auto [stop, error] = std::from_chars(given->value.data(), end, value);
    const std::string_view unit(stop, static_cast<std::size_t>(end - stop));
    const std::string_view units = "KMG";
    const std::size_t power = unit.size() == 1 ? units.find(unit[0]) : std::string_view::npos;
    const int shift = unit.empty() ? 0 : 10 * (static_cast<int>(power) + 1);
    const bool known = unit.empty() || power != std::string_view::npos;
    if (error != std::errc() || !known || value > most >> shift) {
      complain(*given, "must be a number of bytes up to " + std::to_string(most) + ", or one with K, M or G behind it");
    } else {
      into = value << shift;
    }
  }

  void one_of(const char* name, const std::vector<std::string_view>& allowed, std::string& into) {
    const Given* given = find(name);
    if (given == nullptr) return;
    if (std::find(allowed.begin(), allowed.end(), given->value) == allowed.end()) {
      complain(*given, "must be one of: " + joined(allowed));
    } else {
      into = given->value;
    }
  }

  void address(const char* name, std::string& into) {
    const Given* given = find(name);
    if (given == nullptr) return;
    in6_addr parsed{};
    if (::inet_pton(AF_INET, given->value.c_str(), &parsed) != 1 &&
        ::inet_pton(AF_INET6, given->value.c_str(), &parsed) != 1) {
      complain(*given, "must be an IPv4 or IPv6 address in numbers");
    } else {
      into = given->value;
    }
  }

  [[nodiscard]] const std::optional<ConfigError>& complaint() const { return complaint_; }

 private:
  const Given* find(const char* name) const {
    const auto it = values_.find(name);
    return it == values_.end() ? nullptr : &it->second;
  }
  void complain(const Given& given, const std::string& what) {
    if (!complaint_) complaint_ = ConfigError{given.where + ": \"" + given.value + "\" " + what};
  }

  const GivenValues& values_;
  std::optional<ConfigError> complaint_;
};

/// The policy that was given, or the first complaint about it.
std::variant<scheduler::PolicyLayer, ConfigError> judge_policy(const GivenValues& values) {
  scheduler::PolicyLayer layer;
  if (const auto rule = values.find("rule"); rule != values.end()) {
    layer.rule = rule->second.value;
    if (const auto error = scheduler::check(layer)) return ConfigError{rule->second.where + ": " + error->text};
  }
  const auto take = [&](const std::string& key, const std::string& name) -> std::optional<ConfigError> {
    const auto given = values.find(key);
    if (given == values.end()) return std::nullopt;
    const auto error = scheduler::check({layer.rule, {{name, given->second.value}}});
    if (error) return ConfigError{given->second.where + (key == name ? "" : " " + name) + ": " + error->text};
    layer.options.emplace(name, given->second.value);
    return std::nullopt;
  };
  for (const auto& option : scheduler::common_options()) {
    if (auto error = take(std::string(option.name), std::string(option.name))) return *error;
  }
  const std::string prefix = std::string(kRuleOption) + ' ';
  for (auto it = values.lower_bound(prefix); it != values.end() && it->first.starts_with(prefix); ++it) {
    const std::string name = it->first.substr(prefix.size());
    const auto common = scheduler::common_options();
    if (std::any_of(common.begin(), common.end(), [&](const auto& option) { return option.name == name; })) {
      return ConfigError{it->second.where + ": " + name + " is an option of its own"};
    }
    if (auto error = take(it->first, name)) return *error;
  }
  return layer;
}

std::variant<Config, ConfigAnswer, ConfigError> judge(const GivenValues& values) {
  Config config;
  Taker take(values);
  take.text("database", config.database);
  take.address("listen", config.listen);
  take.number<std::uint16_t>("request-port", 0, 65535, config.request_port);
  take.number<std::uint16_t>("data-port", 0, 65535, config.data_port);
  take.text("admin-socket", config.admin_socket);
  take.number<std::size_t>("max-sessions", 1, kMaxSessions, config.max_sessions);
  take.number<std::size_t>("max-sessions-per-address", 1, kMaxSessions, config.max_sessions_per_address);
  take.seconds("hello-timeout", kMaxTime, config.hello_timeout);
  take.seconds("join-timeout", kMaxJoinTime, config.join_timeout);
  take.seconds("stall-timeout", kMaxTime, config.stall_timeout);
  take.number<std::uint64_t>("min-rate", 0, kMaxMinRate, config.min_rate);
  take.seconds("drain-timeout", kMaxTime, config.drain_timeout);
  take.seconds("grace-time", kMaxTime, config.grace_time);
  take.bytes("cache-size", kMaxCacheBytes, config.cache_bytes);
  take.one_of("log-level", {kLogLevels.begin(), kLogLevels.end()}, config.log_level);
  if (take.complaint()) return *take.complaint();
  if (config.request_port != 0 && config.request_port == config.data_port) {
    return ConfigError{"request-port and data-port are both " + std::to_string(config.data_port) +
                       ", but each needs a port of its own"};
  }
  return config;
}

}  // namespace

std::variant<Config, ConfigAnswer, ConfigError> read_config(int argc, const char* const* argv,
                                                            const std::string& version) {
  auto said = read_command_line(argc, argv, version);
  if (auto* answer = std::get_if<ConfigAnswer>(&said)) return *answer;
  if (auto* error = std::get_if<ConfigError>(&said)) return *error;
  auto& line = std::get<CommandLine>(said);
  GivenValues from_file;
  if (line.file) {
    auto read = read_config_file(*line.file);
    if (auto* error = std::get_if<ConfigError>(&read)) return *error;
    from_file = std::get<GivenValues>(std::move(read));
    // All of the file is judged, also what the command line overrides: a fault must not wait for another start.
    auto judged = judge(from_file);
    if (auto* error = std::get_if<ConfigError>(&judged)) return *error;
  }
  auto line_policy = judge_policy(line.values);
  if (auto* error = std::get_if<ConfigError>(&line_policy)) return *error;
  auto file_policy = judge_policy(from_file);
  if (auto* error = std::get_if<ConfigError>(&file_policy)) return *error;
  line.values.merge(from_file);
  auto judged = judge(line.values);
  if (auto* config = std::get_if<Config>(&judged)) {
    config->check_only = line.check_only;
    config->command_line_policy = std::get<scheduler::PolicyLayer>(std::move(line_policy));
    config->file_policy = std::get<scheduler::PolicyLayer>(std::move(file_policy));
  }
  return judged;
}

}  // namespace pmcd
