// SPDX-License-Identifier: MIT
// Options by Boost.Program_options. Values are taken as text, because an error has to say which option, in which file
// and line, and what would be right.
#include "daemon/config_text.h"

#include <boost/program_options.hpp>
#include <fstream>
#include <iomanip>
#include <sstream>
#include <utility>

#include "daemon/scheduler/registry.h"

namespace pmcd {
namespace {

namespace po = boost::program_options;

po::options_description file_options() {
  po::options_description options("Options, also in the config file as name = value");
  const auto text = [](const char* name) { return po::value<std::string>()->value_name(name); };
  options.add_options()                                                                                        //
      ("database", text("FILE"), "mesh database, made if it is not there (/var/lib/pmcd/meshes.db)")           //
      ("listen", text("ADDRESS"), "IP address to listen on (127.0.0.1)")                                       //
      ("request-port", text("PORT"), "port of the request channel, 0 for any free one (7621)")                 //
      ("data-port", text("PORT"), "port of the data channel, 0 for any free one (7622)")                       //
      ("admin-socket", text("FILE"), "Unix socket for pmcctl (/run/pmcd/admin.sock)")                          //
      ("rule", text("NAME"), "distribution rule (gain)")                                                       //
      ("rule-option", text("NAME=VALUE"), "an option of that rule; may be given several times (until=5)")      //
      ("slots", text("N"), "transfers that run at the same time, or auto: as many as fill the uplink (auto)")  //
      ("quantum", text("MS"), "a longer turn is interrupted when another is to go; 0: none (250)")             //
      ("aging", text("SECONDS"), "a request that waits longer goes before all others; 0: none (0)")            //
      ("uplink", text("KBIT"), "what the uplink carries in kbit/s; 0: measured (0)")                           //
      ("max-sessions", text("N"), "sessions at the same time (9000)")                                          //
      ("max-sessions-per-address", text("N"), "of these, from one IPv4 address or IPv6 /64 (256)")             //
      ("hello-timeout", text("SECONDS"), "for the first frame of a connection (10)")                           //
      ("join-timeout", text("SECONDS"), "for the data channel of a session (30)")                              //
      ("stall-timeout", text("SECONDS"), "a client that takes nothing for so long is dropped (10)")            //
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

/// Adds what was given once. A sentence if it was given before, or is no "NAME=VALUE" where it must be.
std::optional<ConfigError> add(const std::string& name, const std::string& value, const std::string& where,
                               GivenValues& values) {
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
std::optional<ConfigError> read_line(const std::string& line, const std::string& place, GivenValues& values) {
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

std::variant<GivenValues, ConfigError> read_config_file(const std::string& path) {
  const ConfigError unreadable{"--config: " + path + " cannot be read"};
  std::ifstream file(path);
  if (!file) return unreadable;
  GivenValues values;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    const std::string place = path + ":" + std::to_string(number);
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (auto error = read_line(line, place, values)) return *error;
  }
  if (file.bad()) return unreadable;
  return values;
}

std::variant<CommandLine, ConfigAnswer, ConfigError> read_command_line(int argc, const char* const* argv,
                                                                       const std::string& version) {
  po::options_description known;
  known.add(file_options()).add(command_options());
  constexpr int kStyle = po::command_line_style::unix_style & ~po::command_line_style::allow_guessing;
  CommandLine line;
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
        line.check_only = true;
      } else if (name == "config") {
        if (line.file) return ConfigError{"--config was given before"};
        line.file = option.value.at(0);
      } else if (auto error = add(name, option.value.at(0), "--" + name, line.values)) {
        return *error;
      }
    }
  } catch (const po::too_many_positional_options_error&) {
    return ConfigError{"pmcd takes options only; --help lists them"};
  } catch (const po::error& error) {
    return ConfigError{std::string(error.what()) + "; --help lists the options"};
  }
  return line;
}

}  // namespace pmcd
