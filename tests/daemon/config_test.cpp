// SPDX-License-Identifier: MIT
// Options and config file: which value counts, and that a complaint names option, file and line.
#include "daemon/config.h"

#include <gtest/gtest.h>

#include <fstream>
#include <initializer_list>
#include <vector>

#include "tests/store/fake_mesh.h"

namespace pmcd {
namespace {

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
  EXPECT_EQ(config.rule, "fifo");
  EXPECT_EQ(config.slots, 1U);
  EXPECT_EQ(config.log_level, "info");
  EXPECT_FALSE(config.check_only);
}

TEST(Config, EveryOption) {
  const Config config =
      config_of({"--database", "/d", "--listen=::1", "--request-port", "0", "--data-port=65535", "--admin-socket", "/s",
                 "--rule", "fifo", "--slots", "7", "--log-level", "debug", "--check-config"});
  EXPECT_EQ(config.database, "/d");
  EXPECT_EQ(config.listen, "::1");
  EXPECT_EQ(config.request_port, 0);
  EXPECT_EQ(config.data_port, 65535);
  EXPECT_EQ(config.admin_socket, "/s");
  EXPECT_EQ(config.slots, 7U);
  EXPECT_EQ(config.log_level, "debug");
  EXPECT_TRUE(config.check_only);
}

TEST(Config, HelpAndVersion) {
  EXPECT_EQ(std::get<ConfigAnswer>(read({"--version"})).text, "pmcd 1.2.3\n");
  const std::string help = std::get<ConfigAnswer>(read({"--help"})).text;
  for (const char* name : {"--config", "--database", "--listen", "--request-port", "--data-port", "--admin-socket",
                           "--rule", "--slots", "--log-level", "--check-config", "--version", "--help", "fifo"}) {
    EXPECT_NE(help.find(name), std::string::npos) << name;
  }
}

TEST(Config, ComplaintsNameTheOption) {
  EXPECT_EQ(complaint({"--slots", "0"}), "--slots: \"0\" must be a number from 1 to 1024");
  EXPECT_EQ(complaint({"--slots", "3x"}), "--slots: \"3x\" must be a number from 1 to 1024");
  EXPECT_EQ(complaint({"--request-port", "65536"}), "--request-port: \"65536\" must be a number from 0 to 65535");
  EXPECT_EQ(complaint({"--data-port=-1"}), "--data-port: \"-1\" must be a number from 0 to 65535");
  EXPECT_EQ(complaint({"--rule", "lottery"}), "--rule: \"lottery\" must be one of: fifo");
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
  EXPECT_EQ(config.slots, 5U);
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
  EXPECT_EQ(complain("\nslots = 0\n"), "FILE:2: slots: \"0\" must be a number from 1 to 1024");
  EXPECT_EQ(complain("slots = 1\nslot = 1\n"), "FILE:2: slot is no option of the config file");
  EXPECT_EQ(complain("# x\n\nwhat is this\n"), "FILE:3: expected \"name = value\", got \"what is this\"");
  EXPECT_EQ(complain("slots = 1\nrule = fifo\nslots = 2\n"), "FILE:3: slots was given before");
  EXPECT_EQ(complain("config = other\n"), "FILE:1: config is no option of the config file");
  EXPECT_EQ(complain("database =\n"), "FILE:1: database: \"\" must not be empty");
  EXPECT_EQ(complain("[section]\nslots = 1\nrule = none\n"), "FILE:3: rule: \"none\" must be one of: fifo");
}

TEST_F(ConfigFileTest, FaultsAreSaidEvenIfTheCommandLineOverridesThem) {
  const std::string path = file("slots = many\n");
  EXPECT_EQ(complaint({"--slots", "2", "--config", path}),
            path + ":1: slots: \"many\" must be a number from 1 to 1024");
}

}  // namespace
}  // namespace pmcd
