// SPDX-License-Identifier: MIT
// Options and config file: which value counts, and that a complaint names option, file and line.
#include "daemon/config.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <fstream>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "tests/store/fake_mesh.h"

namespace pmcd {
namespace {

using namespace std::chrono_literals;

std::variant<Config, ConfigAnswer, ConfigError> read(std::vector<std::string> options) {
  std::vector<const char*> argv = {"pmcd"};
  for (const std::string& option : options) argv.push_back(option.c_str());
  return read_config(static_cast<int>(argv.size()), argv.data(), "1.2.3");
}

Config config_of(std::vector<std::string> options) {
  auto result = read(std::move(options));
  if (const auto* error = std::get_if<ConfigError>(&result)) ADD_FAILURE() << error->text;
  return std::holds_alternative<Config>(result) ? std::get<Config>(result) : Config{};
}

std::string complaint(std::vector<std::string> options) {
  auto result = read(std::move(options));
  const auto* error = std::get_if<ConfigError>(&result);
  return error == nullptr ? "no complaint" : error->text;
}

class ConfigFileTest : public ::testing::Test {
 protected:
  std::string file(const std::string& content) {
    const std::string path = folder_.file("pmcd.conf");
    std::ofstream(path) << content;
    return path;
  }
  test::TemporaryFolder folder_;
};

TEST(Config, Defaults) {
  const Config config = config_of({});
  EXPECT_EQ(config.database, "/var/lib/pmcd/meshes.db");
  EXPECT_EQ(config.listen, "127.0.0.1");
  EXPECT_EQ(config.request_port, 7621);
  EXPECT_EQ(config.data_port, 7622);
  EXPECT_EQ(config.admin_socket, "/run/pmcd/admin.sock");
  EXPECT_EQ(config.command_line_policy, scheduler::PolicyLayer{});
  EXPECT_EQ(config.file_policy, scheduler::PolicyLayer{});
  EXPECT_EQ(config.max_sessions, 9'000U);
  EXPECT_EQ(config.max_sessions_per_address, 256U);
  EXPECT_EQ(config.hello_timeout, 10s);
  EXPECT_EQ(config.join_timeout, 30s);
  EXPECT_EQ(config.stall_timeout, 10s);
  EXPECT_EQ(config.min_rate, 500U);
  EXPECT_EQ(config.drain_timeout, 5s);
  EXPECT_EQ(config.grace_time, 10min);
  EXPECT_EQ(config.cache_bytes, 64U << 20);
  EXPECT_EQ(config.log_level, "info");
  EXPECT_FALSE(config.check_only);
}

TEST(Config, EveryOption) {
  const Config config = config_of({"--database",
                                   "/d",
                                   "--listen=::1",
                                   "--request-port",
                                   "0",
                                   "--data-port=65535",
                                   "--admin-socket",
                                   "/s",
                                   "--rule",
                                   "fcsf",
                                   "--slots",
                                   "7",
                                   "--quantum",
                                   "500",
                                   "--aging",
                                   "60",
                                   "--uplink",
                                   "256",
                                   "--rule-option",
                                   "burst=2",
                                   "--log-level",
                                   "debug",
                                   "--check-config"});
  EXPECT_EQ(config.database, "/d");
  EXPECT_EQ(config.listen, "::1");
  EXPECT_EQ(config.request_port, 0);
  EXPECT_EQ(config.data_port, 65535);
  EXPECT_EQ(config.admin_socket, "/s");
  EXPECT_EQ(config.command_line_policy,
            (scheduler::PolicyLayer{
                "fcsf", {{"aging", "60"}, {"burst", "2"}, {"quantum", "500"}, {"slots", "7"}, {"uplink", "256"}}}));
  EXPECT_EQ(config.log_level, "debug");
  EXPECT_TRUE(config.check_only);
}

TEST(Config, EveryLimit) {
  const Config config = config_of({"--max-sessions", "1000000", "--max-sessions-per-address=1", "--hello-timeout",
                                   "0.001", "--join-timeout", "3600", "--stall-timeout", "2.5", "--min-rate", "0",
                                   "--drain-timeout", "86400", "--grace-time", "10", "--cache-size", "0"});
  EXPECT_EQ(config.max_sessions, 1'000'000U);
  EXPECT_EQ(config.max_sessions_per_address, 1U);
  EXPECT_EQ(config.hello_timeout, 1ms);
  EXPECT_EQ(config.join_timeout, 1h);
  EXPECT_EQ(config.stall_timeout, 2'500ms);
  EXPECT_EQ(config.min_rate, 0U);
  EXPECT_EQ(config.drain_timeout, 24h);
  EXPECT_EQ(config.grace_time, 10s);
  EXPECT_EQ(config.cache_bytes, 0U);
}

TEST(Config, TimesAreSecondsWithDecimals) {
  for (const auto& [text, expected] :
       {std::pair{"1", 1'000ms}, {"0.25", 250ms}, {"10.0004", 10'000ms}, {"0.0015", 2ms}}) {
    EXPECT_EQ(config_of({"--drain-timeout", text}).drain_timeout, expected) << text;
  }
  const std::string range = " must be a number of seconds from 0.001 to 86400";
  for (const char* name : {"--hello-timeout", "--stall-timeout", "--drain-timeout", "--grace-time"}) {
    for (const char* text : {"0", "0.0009", "-1", "86400.1", "5s", "1e1", "nan", "inf", " 5", "5 ", "0x5", "1,5"}) {
      const std::string option = std::string(name) + "=" + text;
      EXPECT_EQ(complaint({option}), std::string(name) + ": \"" + text + "\"" + range);
    }
  }
  EXPECT_EQ(complaint({"--join-timeout", "3601"}),
            "--join-timeout: \"3601\" must be a number of seconds from 0.001 to 3600")
      << "it travels in 16 bits";
}

TEST(Config, CacheSizeHasUnits) {
  const auto size = [](const char* text) { return config_of({"--cache-size", text}).cache_bytes; };
  EXPECT_EQ(size("1"), 1U);
  EXPECT_EQ(size("1000"), 1'000U);
  EXPECT_EQ(size("3K"), 3'072U);
  EXPECT_EQ(size("16M"), 16'777'216U);
  EXPECT_EQ(size("2G"), 2'147'483'648U);
  EXPECT_EQ(size("0G"), 0U);
  EXPECT_EQ(size("1024G"), std::uint64_t{1} << 40);
  EXPECT_EQ(size("1099511627776"), std::uint64_t{1} << 40);
  for (const char* text : {"1025G", "1099511627777", "18446744073709551616", "99999999999G", "-1", "1.5G", "K", "1k",
                           "1KB", "1 K", "1T", "M1", "0x10"}) {
    EXPECT_EQ(complaint({std::string("--cache-size=") + text}),
              std::string("--cache-size: \"") + text +
                  "\" must be a number of bytes up to 1099511627776, or one with K, M or G behind it");
  }
}

TEST(Config, CountsHaveTheirRanges) {
  EXPECT_EQ(complaint({"--max-sessions", "0"}), "--max-sessions: \"0\" must be a number from 1 to 1000000");
  EXPECT_EQ(complaint({"--max-sessions", "1000001"}), "--max-sessions: \"1000001\" must be a number from 1 to 1000000");
  EXPECT_EQ(complaint({"--max-sessions-per-address", "0"}),
            "--max-sessions-per-address: \"0\" must be a number from 1 to 1000000");
  EXPECT_EQ(complaint({"--min-rate=-1"}), "--min-rate: \"-1\" must be a number from 0 to 1000000000");
  EXPECT_EQ(complaint({"--min-rate", "500K"}), "--min-rate: \"500K\" must be a number from 0 to 1000000000");
  EXPECT_EQ(complaint({"--min-rate", "1000000001"}),
            "--min-rate: \"1000000001\" must be a number from 0 to 1000000000");
}

TEST(Config, HelpAndVersion) {
  EXPECT_EQ(std::get<ConfigAnswer>(read({"--version"})).text, "pmcd 1.2.3\n");
  const std::string help = std::get<ConfigAnswer>(read({"--help"})).text;
  for (const char* name : {"--config",        "--database",
                           "--listen",        "--request-port",
                           "--data-port",     "--admin-socket",
                           "--rule",          "--slots",
                           "--max-sessions",  "--max-sessions-per-address",
                           "--hello-timeout", "--join-timeout",
                           "--stall-timeout", "--min-rate",
                           "--drain-timeout", "--grace-time",
                           "--cache-size",    "--log-level",
                           "--check-config",  "--version",
                           "--help",          "fifo"}) {
    EXPECT_NE(help.find(name), std::string::npos) << name;
  }
}

TEST(Config, ComplaintsNameTheOption) {
  EXPECT_EQ(complaint({"--slots", "0"}), "--slots: \"0\" is not 1 to 1024, or auto");
  EXPECT_EQ(complaint({"--slots", "3x"}), "--slots: \"3x\" is not 1 to 1024, or auto");
  EXPECT_EQ(complaint({"--request-port", "65536"}), "--request-port: \"65536\" must be a number from 0 to 65535");
  EXPECT_EQ(complaint({"--data-port=-1"}), "--data-port: \"-1\" must be a number from 0 to 65535");
  EXPECT_EQ(complaint({"--rule", "lottery"}),
            "--rule: \"lottery\" is none of: fifo, lcfs, spf, fcsf, srpt, fsp, gain, fair");
  EXPECT_EQ(complaint({"--rule-option", "burst=2"}),
            "--rule-option burst: is one of rule fcsf, and no rule is given with it");
  EXPECT_EQ(complaint({"--rule", "spf", "--rule-option", "burst=2"}),
            "--rule-option burst: is one of rule fcsf, not of rule spf");
  EXPECT_EQ(complaint({"--rule", "fcsf", "--rule-option", "burst=3"}), "--rule-option burst: \"3\" is none of: 1, 2");
  EXPECT_EQ(complaint({"--rule", "fcsf", "--rule-option", "burst"}), "--rule-option: \"burst\" must be NAME=VALUE");
  EXPECT_EQ(complaint({"--rule", "fcsf", "--rule-option", "burst=2", "--rule-option", "burst=1"}),
            "--rule-option burst was given before");
  EXPECT_EQ(complaint({"--rule-option", "slots=2"}), "--rule-option: slots is an option of its own");
  EXPECT_EQ(complaint({"--quantum", "-1"}), "--quantum: \"-1\" is not milliseconds, 0 to 600000");
  EXPECT_EQ(complaint({"--log-level", "loud"}),
            "--log-level: \"loud\" must be one of: trace, debug, info, warn, error, critical, off");
  EXPECT_EQ(complaint({"--listen", "localhost"}), "--listen: \"localhost\" must be an IPv4 or IPv6 address in numbers");
  EXPECT_EQ(complaint({"--database="}),
            "the argument for option '--database' should follow immediately after the "
            "equal sign; --help lists the options");
  EXPECT_EQ(complaint({"--slots", "1", "--slots", "2"}), "--slots was given before");
  EXPECT_EQ(complaint({"--request-port", "5", "--data-port", "5"}),
            "request-port and data-port are both 5, but each needs a port of its own");
  EXPECT_EQ(complaint({"--slot", "1"}), "unrecognised option '--slot'; --help lists the options");
  EXPECT_EQ(complaint({"serve"}), "pmcd takes options only; --help lists them");
  EXPECT_EQ(complaint({"--config", "/no/such/file"}), "--config: /no/such/file cannot be read");
}

TEST_F(ConfigFileTest, TheSameNamesAndTheCommandLineGoesFirst) {
  const std::string path =
      file("# where the meshes are\ndatabase = /file.db\n\nslots=3\nlog-level = warn  # quiet\r\nrequest-port = 0\n");
  const Config config = config_of({"--slots", "5", "--config", path});
  EXPECT_EQ(config.database, "/file.db");
  EXPECT_EQ(config.command_line_policy.options.at("slots"), "5");
  EXPECT_EQ(config.file_policy.options.at("slots"), "3");
  EXPECT_EQ(config.log_level, "warn");
  EXPECT_EQ(config.request_port, 0);
}

TEST_F(ConfigFileTest, ComplaintsNameFileAndLine) {
  const auto complain = [this](const std::string& content) {
    const std::string path = file(content);
    std::string text = complaint({"--config", path});
    if (text.rfind(path, 0) == 0) text.replace(0, path.size(), "FILE");
    return text;
  };
  EXPECT_EQ(complain("\nslots = 0\n"), "FILE:2: slots: \"0\" is not 1 to 1024, or auto");
  EXPECT_EQ(complain("slots = 1\nslot = 1\n"), "FILE:2: slot is no option of the config file");
  EXPECT_EQ(complain("# x\n\nwhat is this\n"), "FILE:3: expected \"name = value\", got \"what is this\"");
  EXPECT_EQ(complain("slots = 1\nrule = fifo\nslots = 2\n"), "FILE:3: slots was given before");
  EXPECT_EQ(complain("config = other\n"), "FILE:1: config is no option of the config file");
  EXPECT_EQ(complain("database =\n"), "FILE:1: database: \"\" must not be empty");
  EXPECT_EQ(complain("[section]\nslots = 1\nrule = none\n"),
            "FILE:3: rule: \"none\" is none of: fifo, lcfs, spf, fcsf, srpt, fsp, gain, fair");
}

TEST_F(ConfigFileTest, LimitsToo) {
  const std::string path = file(
      "max-sessions = 5\nmax-sessions-per-address = 2\nhello-timeout = 1.5\njoin-timeout = 2\nstall-timeout = 3\n"
      "min-rate = 9600\ndrain-timeout = 4\ngrace-time = 0.5\ncache-size = 8M\n");
  const Config config = config_of({"--config", path, "--stall-timeout", "7"});
  EXPECT_EQ(config.max_sessions, 5U);
  EXPECT_EQ(config.max_sessions_per_address, 2U);
  EXPECT_EQ(config.hello_timeout, 1'500ms);
  EXPECT_EQ(config.join_timeout, 2s);
  EXPECT_EQ(config.stall_timeout, 7s);
  EXPECT_EQ(config.min_rate, 9'600U);
  EXPECT_EQ(config.drain_timeout, 4s);
  EXPECT_EQ(config.grace_time, 500ms);
  EXPECT_EQ(config.cache_bytes, 8U << 20);
  const std::string bad = file("cache-size = 8M\ngrace-time = ten\n");
  EXPECT_EQ(complaint({"--config", bad}),
            bad + ":2: grace-time: \"ten\" must be a number of seconds from 0.001 to 86400");
}

TEST_F(ConfigFileTest, FaultsAreSaidEvenIfTheCommandLineOverridesThem) {
  const std::string path = file("slots = many\n");
  EXPECT_EQ(complaint({"--slots", "2", "--config", path}), path + ":1: slots: \"many\" is not 1 to 1024, or auto");
}

}  // namespace
}  // namespace pmcd
