// SPDX-License-Identifier: MIT
// Options by Boost.Program_options. Values are taken as text and judged here, because an error has to say which option,
// in which file and line, and what would be right.
#include "daemon/config.h"

#include <arpa/inet.h>

#include <algorithm>
#include <array>
#include <boost/program_options.hpp>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iomanip>
#include <map>
#include <optional>
#include <sstream>
#include <string_view>
#include <vector>

#include "daemon/scheduler/registry.h"

namespace pmcd {
namespace {

namespace po = boost::program_options;

/// A value and where it was given: "--slots" or "pmcd.conf:3: slots".
struct Given {
  std::string value;
  std::string where;
};
using Values = std::map<std::string, Given>;

constexpr std::array kLogLevels = {"trace", "debug", "info", "warn", "error", "critical", "off"};

po::options_description file_options() {
  po::options_description options("Options, also in the config file as name = value");
  const auto text = [](const char* name) { return po::value<std::string>()->value_name(name); };
  options.add_options()                                                                               //
      ("database", text("FILE"), "mesh database, made if it is not there (/var/lib/pmcd/meshes.db)")  //
      ("listen", text("ADDRESS"), "IP address to listen on (127.0.0.1)")                              //
      ("request-port", text("PORT"), "port of the request channel, 0 for any free one (7621)")        //
      ("data-port", text("PORT"), "port of the data channel, 0 for any free one (7622)")              //
      ("admin-socket", text("FILE"), "Unix socket for pmcctl (/run/pmcd/admin.sock)")                 //
      ("rule", text("NAME"), "distribution rule (fifo)")                                              //
      ("rule-option", text("NAME=VALUE"), "an option of that rule; may be given several times")       //
      ("slots", text("N"), "transfers that run at the same time, or auto: as fill the uplink (1)")    //
      ("quantum", text("MS"), "a longer turn is interrupted when another is to go; 0: none (0)")      //
      ("aging", text("SECONDS"), "a request that waits longer goes before all others; 0: none (0)")   //
      ("uplink", text("KBIT"), "what the uplink carries in kbit/s; 0: measured (0)")                  //
      ("max-sessions", text("N"), "sessions at the same time (9000)")                                 //
      ("max-sessions-per-address", text("N"), "of these, from one IPv4 address or IPv6 /64 (256)")    //
      ("hello-timeout", text("SECONDS"), "for the first frame of a connection (10)")                  //
      ("join-timeout", text("SECONDS"), "for the data channel of a session (30)")                     //
      ("stall-timeout", text("SECONDS"), "a client that takes nothing for so long is dropped (10)")   //
      ("min-rate", text("BYTES"),
       "a client that takes less a second, over 30 s of its turn, is dropped; 0: none (500)")            //
      ("drain-timeout", text("SECONDS"), "for running transfers when pmcd is told to end (5)")           //
      ("grace-time", text("SECONDS"), "for sessions with a mesh that was replaced or removed (600)")     //
      ("cache-size", text("BYTES"), "memory for packets sent lately; K, M, G behind it; 0: none (64M)")  //
      ("log-level", text("LEVEL"), "trace, debug, info, warn, error, critical or off (info)");
  return options;
}

po::options_description command_options() {
  po::options_description options("Options of the command line only");
  options.add_options()                                                               //
      ("config", po::value<std::string>()->value_name("FILE"), "read this file too")  //
      ("check-config", "check options and config file, say what is wrong, and end")   //
      ("version", "print the version and end")                                        //
      ("help", "print this text and end");
  return options;
}

constexpr const char* kRuleOption = "rule-option";

/// Adds what was given once; an option of a rule stands under "rule-option NAME". A sentence if it was given before, or
/// is no "NAME=VALUE".
std::optional<ConfigError> add(const std::string& name, const std::string& value, const std::string& where,
                               Values& values) {
  std::string key = name;
  Given given{value, where};
  if (name == kRuleOption) {
    const std::size_t equals = value.find('=');
    if (equals == std::string::npos || equals == 0) {
      return ConfigError{where + ": \"" + value + "\" must be NAME=VALUE"};
    }
    key += ' ' + value.substr(0, equals);
    given.value = value.substr(equals + 1);
  }
  if (values.try_emplace(key, std::move(given)).second) return std::nullopt;
  return ConfigError{where + (name == kRuleOption ? ' ' + key.substr(name.size() + 1) : "") + " was given before"};
}

/// One line of the config file; nothing is added for blank lines and comments.
std::optional<ConfigError> read_line(const std::string& line, const std::string& place, Values& values) {
  std::istringstream stream(line);
  try {
    for (const auto& option : po::parse_config_file(stream, file_options()).options) {
      if (option.value.size() != 1) return ConfigError{place + ": " + option.string_key + " needs one value"};
      if (auto error = add(option.string_key, option.value[0], place + ": " + option.string_key, values)) return error;
    }
  } catch (const po::unknown_option& error) {
    return ConfigError{place + ": " + error.get_option_name() + " is no option of the config file"};
  } catch (const po::error&) {
    return ConfigError{place + ": expected \"name = value\", got \"" + line + "\""};
  }
  return std::nullopt;
}

std::optional<ConfigError> read_file(const std::string& path, Values& values) {
  std::ifstream file(path);
  if (!file) return ConfigError{"--config: " + path + " cannot be read"};
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    const std::string place = path + ":" + std::to_string(number);
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (auto error = read_line(line, place, values)) return error;
  }
  if (file.bad()) return ConfigError{"--config: " + path + " cannot be read"};
  return std::nullopt;
}

std::string joined(const std::vector<std::string_view>& words) {
  std::string text;
  for (const std::string_view word : words) text += (text.empty() ? "" : ", ") + std::string(word);
  return text;
}

/// Takes values out of what was given, checks them, and remembers the first complaint.
class Taker {
 public:
  explicit Taker(const Values& values) : values_(values) {}

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

  const Values& values_;
  std::optional<ConfigError> complaint_;
};

/// The policy that was given, or the first complaint about it.
std::variant<scheduler::PolicyLayer, ConfigError> judge_policy(const Values& values) {
  scheduler::PolicyLayer layer;
  if (const auto rule = values.find("rule"); rule != values.end()) {
    layer.rule = rule->second.value;
    if (const auto error = scheduler::check(layer)) return ConfigError{rule->second.where + ": " + error->text};
  }
  const auto take = [&](const std::string& key, const std::string& name) -> std::optional<ConfigError> {
    const auto given = values.find(key);
    if (given == values.end()) return std::nullopt;
    const auto error = scheduler::check({layer.rule, {{name, given->second.value}}});
    if (error) return ConfigError{given->second.where + ": " + error->text};
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

std::variant<Config, ConfigAnswer, ConfigError> judge(const Values& values) {
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

std::string help_text() {
  std::ostringstream text;
  text << "pmcd serves progressive meshes, packet by packet.\nUsage: pmcd [option...]\n\n"
       << file_options() << '\n'
       << command_options() << "\nRules:\n";
  for (const auto& rule : scheduler::all_rules()) {
    text << "  " << std::left << std::setw(6) << rule.name << rule.summary << '\n';
    for (const auto& option : rule.options) {
      std::string words;
      for (const auto word : option.words) words += (words.empty() ? "" : "|") + std::string(word);
      text << "          " << option.name << '=' << words << "  " << option.summary << " (" << option.words.front()
           << ")\n";
    }
  }
  return text.str();
}

}  // namespace

std::variant<Config, ConfigAnswer, ConfigError> read_config(int argc, const char* const* argv,
                                                            const std::string& version) {
  po::options_description known;
  known.add(file_options()).add(command_options());
  constexpr int kStyle = po::command_line_style::unix_style & ~po::command_line_style::allow_guessing;
  Values values;
  std::optional<std::string> file;
  bool check_only = false;
  try {
    const auto parsed = po::command_line_parser(argc, argv)
                            .options(known)
                            .style(kStyle)
                            .positional(po::positional_options_description())
                            .run();
    for (const auto& option : parsed.options) {
      const std::string& name = option.string_key;
      if (name == "help") return ConfigAnswer{help_text()};
      if (name == "version") return ConfigAnswer{"pmcd " + version + "\n"};
      if (name == "check-config") {
        check_only = true;
      } else if (name == "config") {
        if (file) return ConfigError{"--config was given before"};
        file = option.value.at(0);
      } else if (auto error = add(name, option.value.at(0), "--" + name, values)) {
        return *error;
      }
    }
  } catch (const po::too_many_positional_options_error&) {
    return ConfigError{"pmcd takes options only; --help lists them"};
  } catch (const po::error& error) {
    return ConfigError{std::string(error.what()) + "; --help lists the options"};
  }
  Values from_file;
  if (file) {
    if (auto error = read_file(*file, from_file)) return *error;
    // All of the file is judged, also what the command line overrides: a fault must not wait for another start.
    auto judged = judge(from_file);
    if (auto* error = std::get_if<ConfigError>(&judged)) return *error;
  }
  auto line_policy = judge_policy(values);
  if (auto* error = std::get_if<ConfigError>(&line_policy)) return *error;
  auto file_policy = judge_policy(from_file);
  if (auto* error = std::get_if<ConfigError>(&file_policy)) return *error;
  values.merge(from_file);
  auto judged = judge(values);
  if (auto* config = std::get_if<Config>(&judged)) {
    config->check_only = check_only;
    config->command_line_policy = std::get<scheduler::PolicyLayer>(std::move(line_policy));
    config->file_policy = std::get<scheduler::PolicyLayer>(std::move(file_policy));
  }
  return judged;
}

}  // namespace pmcd
