// SPDX-License-Identifier: MIT
// Where the policy comes from after a start: command line, then the last live change, then the config file.
#include <gtest/gtest.h>

#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>

#include "daemon/store/db.h"
#include "proto/admin_rules.h"
#include "tests/daemon/daemon_process.h"
#include "tests/daemon/raw_client.h"

namespace pmcd::test {
namespace {

using nlohmann::json;

json ask(const DaemonProcess& daemon, const proto::Bytes& request) {
  return json::parse(RawAdmin::open(daemon.admin_socket()).answer(request));
}

json set_rule(const DaemonProcess& daemon, const std::string& rule, std::vector<proto::RuleOptionText> options) {
  proto::AdminSetRule message;
  message.id = 1;
  message.rule = rule;
  message.options = std::move(options);
  return ask(daemon, proto::encode(message));
}

json rule_of(const DaemonProcess& daemon) {
  return ask(daemon, proto::encode(proto::AdminRule{2}));
}

TEST(RuleRestart, ALiveChangeSurvivesKillAndGoesBeforeTheFile) {
  const TemporaryFolder folder;
  const std::string file = folder.file("pmcd.conf");
  std::ofstream(file) << "rule = srpt\nrule-option = scope=packet\nquantum = 700\nuplink = 5000\n";
  {
    DaemonProcess daemon(folder.path(), {"--config", file});
    const json first = rule_of(daemon);
    EXPECT_EQ(first["text"], "srpt aging=0 quantum=700 scope=packet slots=auto uplink=5000");
    EXPECT_EQ(first["sources"]["rule"], "config file");
    EXPECT_EQ(first["sources"]["slots"], "default");
    EXPECT_EQ(first["version"], 0);
    EXPECT_TRUE(first["by"].is_null());
    const json change = set_rule(daemon, "fcsf", {{"burst", "2"}, {"slots", "3"}});
    EXPECT_EQ(change["changed"], true);
    EXPECT_TRUE(change["warnings"].empty());
    // The file's own options of its rule belong to that rule; what is common goes on from the file.
    EXPECT_EQ(change["after"]["text"], "fcsf aging=0 burst=2 quantum=700 slots=3 uplink=5000");
    daemon.kill();
  }
  DaemonProcess daemon(folder.path(), {"--config", file});
  const json again = rule_of(daemon);
  EXPECT_EQ(again["text"], "fcsf aging=0 burst=2 quantum=700 slots=3 uplink=5000");
  EXPECT_EQ(again["version"], 1);
  EXPECT_EQ(again["by"]["pid"], ::getpid());
  EXPECT_EQ(again["sources"]["rule"], "live change");
  EXPECT_EQ(again["sources"]["slots"], "live change");
  EXPECT_EQ(again["sources"]["quantum"], "config file");
  EXPECT_NE(daemon.log().find("rule fcsf aging=0 burst=2 quantum=700 slots=3 uplink=5000"), std::string::npos);
  EXPECT_NE(
      daemon.log().find("live change 1 of the rule goes before the config file, which would make it \"srpt aging=0 "
                        "quantum=700 scope=packet slots=auto uplink=5000\"; pmcctl revert 0 goes back to that"),
      std::string::npos)
      << daemon.log();
  daemon.signal(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0);
}

TEST(RuleRestart, TheCommandLineGoesFirstAndAChangeWarnsOfIt) {
  const TemporaryFolder folder;
  const std::vector<std::string> flags{"--rule", "spf", "--slots", "2"};
  {
    DaemonProcess daemon(folder.path(), flags);
    const json change = set_rule(daemon, "fair", {{"slots", "5"}, {"quantum", "90"}});
    EXPECT_EQ(change["after"]["text"], "fair aging=0 quantum=90 slots=5 uplink=0") << "now it counts";
    EXPECT_EQ(change["warnings"], (json{"a restart will forget rule fair: --rule spf stands on the command line",
                                        "a restart will forget slots=5: --slots 2 stands on the command line"}));
    EXPECT_TRUE(set_rule(daemon, "spf", {{"slots", "2"}, {"quantum", "90"}})["warnings"].empty());
    daemon.signal(SIGTERM);
    EXPECT_EQ(daemon.wait(), 0);
  }
  DaemonProcess daemon(folder.path(), flags);
  const json rule = rule_of(daemon);
  EXPECT_EQ(rule["text"], "spf aging=0 quantum=90 slots=2 uplink=0");
  EXPECT_EQ(rule["sources"]["rule"], "command line");
  EXPECT_EQ(rule["sources"]["slots"], "command line");
  EXPECT_EQ(rule["sources"]["quantum"], "live change");
  daemon.signal(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0);
}

/// The command line's rule comes back without the option that the live change gave it.
TEST(RuleRestart, AnOptionOfTheSameRuleIsForgottenToo) {
  const TemporaryFolder folder;
  DaemonProcess daemon(folder.path(), {"--rule", "fcsf"});
  EXPECT_EQ(set_rule(daemon, "fcsf", {{"burst", "2"}})["warnings"],
            (json{"a restart will forget rule fcsf burst=2: --rule fcsf stands on the command line"}));
}

/// What differs stands in the sentence, also where the rule is the same.
TEST(RuleRestart, AnOptionOfTheCommandLineIsNamed) {
  const TemporaryFolder folder;
  DaemonProcess daemon(folder.path(), {"--rule", "gain", "--rule-option", "until=1"});
  EXPECT_EQ(
      set_rule(daemon, "gain", {})["warnings"],
      (json{"a restart will forget rule gain until=0: --rule gain --rule-option until=1 stands on the command line"}));
  EXPECT_EQ(rule_of(daemon)["options"]["until"], "0") << "also one that nobody has set";
}

proto::Bytes revert(std::uint64_t change) {
  proto::AdminRevert message;
  message.id = 3;
  message.change = change;
  return proto::encode(message);
}

/// A rule's name that no change has: longer than any.
void damage(const std::string& database, const std::string& which) {
  store::Db(database).execute(("UPDATE rule_change SET rule = hex(zeroblob(40)) WHERE " + which).c_str());
}

TEST(RuleRestart, ADamagedChangeIsLeftOutAndTheOneBeforeItCounts) {
  const TemporaryFolder folder;
  {
    DaemonProcess daemon(folder.path(), {});
    set_rule(daemon, "fair", {{"slots", "5"}});
    set_rule(daemon, "spf", {});
    daemon.signal(SIGTERM);
    EXPECT_EQ(daemon.wait(), 0);
  }
  damage(folder.path() + "/meshes.db", "id = 2");
  DaemonProcess daemon(folder.path(), {});
  EXPECT_NE(
      daemon.log().find("live change 2 of the rule is damaged and is left out: the rule's name has 80 bytes, more "
                        "than 64"),
      std::string::npos)
      << daemon.log();
  const json rule = rule_of(daemon);
  EXPECT_EQ(rule["text"], "fair aging=0 quantum=250 slots=5 uplink=0");
  EXPECT_EQ(rule["version"], 2) << "with which a guarded change can name it";
  const json history = ask(daemon, proto::encode(proto::AdminHistory{4, 0}));
  ASSERT_EQ(history["changes"].size(), 1U);
  EXPECT_EQ(history["changes"][0]["number"], 1);
  EXPECT_EQ(history["damaged"], (json{{{"number", 2}, {"error", "the rule's name has 80 bytes, more than 64"}}}));
  RawAdmin admin = RawAdmin::open(daemon.admin_socket());
  admin.connection.send(revert(2));
  const auto refused = expect<proto::ErrorMessage>(admin.connection);
  EXPECT_EQ(refused.code, proto::ErrorCode::storage_failed);
  EXPECT_EQ(refused.text, "rule change 2 is damaged: the rule's name has 80 bytes, more than 64");
  EXPECT_EQ(rule_of(daemon)["text"], rule["text"]) << "a refused change changes nothing";

  // To say again what counts is a change: from then on the damaged one is of the past.
  const json again = ask(daemon, revert(1));
  EXPECT_EQ(again["changed"], true);
  EXPECT_EQ(again["after"]["version"], 3);
  EXPECT_EQ(again["after"]["text"], rule["text"]);
  EXPECT_EQ(ask(daemon, revert(1))["changed"], false);
  daemon.signal(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0);
}

TEST(RuleRestart, WithNoChangeThatIsWholeTheFileCounts) {
  const TemporaryFolder folder;
  const std::string file = folder.file("pmcd.conf");
  std::ofstream(file) << "rule = srpt\n";
  {
    DaemonProcess daemon(folder.path(), {"--config", file});
    set_rule(daemon, "fair", {});
    set_rule(daemon, "spf", {});
    daemon.kill();
  }
  damage(folder.path() + "/meshes.db", "id > 0");
  {
    DaemonProcess daemon(folder.path(), {"--config", file});
    EXPECT_NE(daemon.log().find("live change 1 of the rule is damaged"), std::string::npos) << daemon.log();
    EXPECT_EQ(rule_of(daemon)["rule"], "srpt");
    EXPECT_EQ(rule_of(daemon)["sources"]["rule"], "config file");
    daemon.signal(SIGTERM);
    EXPECT_EQ(daemon.wait(), 0);
  }
  // Not even the numbers can be read.
  const std::string database = folder.path() + "/meshes.db";
  const std::int64_t page = store::Db(database).number("SELECT rootpage FROM sqlite_master WHERE name = 'rule_change'");
  ASSERT_GT(page, 1);
  {
    std::fstream bytes(database, std::ios::in | std::ios::out | std::ios::binary);
    bytes.seekp((page - 1) * 4096);
    bytes.write("\xff\xff\xff\xff", 4);
  }
  DaemonProcess daemon(folder.path(), {"--config", file});
  EXPECT_NE(daemon.log().find("the history of the rule cannot be read, live changes are left out"), std::string::npos)
      << daemon.log();
  EXPECT_EQ(rule_of(daemon)["rule"], "srpt");
  daemon.signal(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0);
}

}  // namespace
}  // namespace pmcd::test
