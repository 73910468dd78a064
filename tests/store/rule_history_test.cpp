// SPDX-License-Identifier: MIT
// The history of rule changes: what is appended is there for good, numbered without gaps, or not at all.
#include "daemon/store/rule_history.h"

#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <limits>

#include "tests/store/mesh_store_fixture.h"
#include "tests/store/outcome.h"

namespace pmcd::store {
namespace {

constexpr std::int64_t kMost = kMaxRuleChanges;

std::int64_t now() {
  return std::chrono::duration_cast<std::chrono::seconds>(std::chrono::system_clock::now().time_since_epoch()).count();
}

/// Its change, or one of number 0.
RuleChange change_of(const Result<RuleChange>& result) {
  EXPECT_EQ(outcome(result), "ok");
  return result.ok() ? result.value() : RuleChange();
}

class RuleHistoryTest : public MeshStoreFixture {
 protected:
  RuleHistory& rules() { return store_->rules(); }

  Result<RuleChange> append(std::optional<std::string> rule, std::optional<std::int64_t> if_version = std::nullopt) {
    return rules().append({std::move(rule), "", 1000, 4321, std::nullopt}, if_version);
  }

  LastChange last() {
    const auto last = rules().last();
    EXPECT_EQ(outcome(last), "ok");
    return last.ok() ? last.value() : LastChange();
  }

  /// The newest change that is whole, or one of number 0.
  RuleChange newest() { return last().change.value_or(RuleChange()); }

  /// Changes numbered 1 to `count`. Not through append(), of which each call waits for the disk.
  void fill(std::int64_t count) {
    Db db(path_);
    Statement row(db,
                  "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < ?1) "
                  "INSERT INTO rule_change SELECT i, 1700000000, 'rule' || i, '', 0, 1, NULL FROM n");
    row.bind(1, count).run();
  }

  std::vector<std::int64_t> numbers(std::size_t most) {
    std::vector<std::int64_t> numbers;
    const auto changes = rules().newest(most);
    EXPECT_EQ(outcome(changes), "ok");
    if (!changes.ok()) return numbers;
    for (const RuleChange& change : changes.value().changes) numbers.push_back(change.number);
    return numbers;
  }

  /// The damaged ones among the newest, "number: error".
  std::vector<std::string> damaged(std::size_t most) {
    const auto changes = rules().newest(most);
    EXPECT_EQ(outcome(changes), "ok");
    return changes.ok() ? texts(changes.value().damaged) : std::vector<std::string>();
  }

  static std::vector<std::string> texts(const std::vector<DamagedChange>& damaged) {
    std::vector<std::string> texts;
    for (const auto& [number, error] : damaged) texts.push_back(std::to_string(number) + ": " + error);
    return texts;
  }

  std::int64_t rows() { return Db(path_).number("SELECT count(*) FROM rule_change"); }
};

void expect_change(const RuleChange& got, const RuleChange& expected) {
  EXPECT_EQ(got.number, expected.number);
  EXPECT_EQ(got.changed_at, expected.changed_at) << expected.number;
  EXPECT_EQ(got.rule, expected.rule) << expected.number;
  EXPECT_EQ(got.options, expected.options) << expected.number;
  EXPECT_EQ(got.uid, expected.uid) << expected.number;
  EXPECT_EQ(got.pid, expected.pid) << expected.number;
  EXPECT_EQ(got.reverts, expected.reverts) << expected.number;
}

TEST_F(RuleHistoryTest, IsEmptyAtFirst) {
  EXPECT_EQ(last().version, 0);
  EXPECT_EQ(last().change.has_value(), false);
  EXPECT_TRUE(last().damaged.empty());
  EXPECT_TRUE(numbers(10).empty());
  const auto none = rules().find(1);
  ASSERT_EQ(outcome(none), "unknown_change");
  EXPECT_EQ(none.error().detail, "there is no rule change 1");
}

TEST_F(RuleHistoryTest, WhatIsAppendedIsThereAfterAReopen) {
  const std::int64_t before = now();
  const auto first = rules().append({"fair", "quantum=4096 weight=2", 1000, 77, std::nullopt}, std::nullopt);
  const auto second = rules().append({std::nullopt, "", 0, 4'194'304, std::nullopt}, std::nullopt);
  const auto third = rules().append({"fair", "quantum=4096 weight=2", 4'294'967'295, 78, 1}, std::nullopt);
  ASSERT_EQ(outcome(first), "ok");
  ASSERT_EQ(outcome(second), "ok");
  ASSERT_EQ(outcome(third), "ok");
  EXPECT_GE(first.value().changed_at, before);
  EXPECT_LE(third.value().changed_at, now());
  const std::vector<RuleChange> expected{
      {1, first.value().changed_at, "fair", "quantum=4096 weight=2", 1000, 77, std::nullopt},
      {2, second.value().changed_at, std::nullopt, "", 0, 4'194'304, std::nullopt},
      {3, third.value().changed_at, "fair", "quantum=4096 weight=2", 4'294'967'295, 78, 1}};
  expect_change(first.value(), expected[0]);
  expect_change(second.value(), expected[1]);
  expect_change(third.value(), expected[2]);
  for (const char* time : {"at once", "opened again"}) {
    for (const RuleChange& change : expected) {
      const auto found = rules().find(change.number);
      ASSERT_EQ(outcome(found), "ok") << time;
      expect_change(found.value(), change);
    }
    expect_change(newest(), expected[2]);
    EXPECT_EQ(last().version, 3) << time;
    EXPECT_EQ(numbers(2), (std::vector<std::int64_t>{3, 2})) << time;
    EXPECT_EQ(numbers(std::numeric_limits<std::size_t>::max()), (std::vector<std::int64_t>{3, 2, 1})) << time;
    EXPECT_TRUE(numbers(0).empty()) << time;
    reopen();
  }
}

TEST_F(RuleHistoryTest, ARuleWithoutANameIsNotNoRule) {
  ASSERT_EQ(outcome(append("")), "ok");
  EXPECT_EQ(change_of(rules().find(1)).rule, std::optional<std::string>(""));
}

TEST_F(RuleHistoryTest, AppendsOnlyToTheVersionThatIsAskedFor) {
  ASSERT_EQ(outcome(append("a", 0)), "ok");
  const auto late = append("b", 0);
  ASSERT_EQ(outcome(late), "version_changed");
  EXPECT_EQ(late.error().detail, "the rule has version 1, not 0");
  EXPECT_EQ(outcome(append("b", 2)), "version_changed");
  EXPECT_EQ(rows(), 1);
  const auto second = append("b", 1);
  ASSERT_EQ(outcome(second), "ok");
  EXPECT_EQ(second.value().number, 2) << "a refused change takes no number";
}

TEST_F(RuleHistoryTest, AnotherConnectionSeesAndCounts) {
  const auto other = MeshStore::open(path_).value();
  ASSERT_EQ(outcome(append("a", 0)), "ok");
  EXPECT_EQ(change_of(other->rules().find(1)).rule, "a");
  EXPECT_EQ(outcome(other->rules().append({"b", "", 0, 1, std::nullopt}, 0)), "version_changed");
  EXPECT_EQ(outcome(other->rules().append({"b", "", 0, 1, std::nullopt}, 1)), "ok");
  EXPECT_EQ(outcome(append("c", 1)), "version_changed");
}

TEST_F(RuleHistoryTest, KeepsTheNewestThousand) {
  fill(kMost - 1);
  ASSERT_EQ(change_of(append("last that fits")).number, kMost);
  EXPECT_EQ(rows(), kMost);
  EXPECT_EQ(outcome(rules().find(1)), "ok");
  ASSERT_EQ(change_of(append("one more")).number, kMost + 1);
  EXPECT_EQ(rows(), kMost);
  EXPECT_EQ(outcome(rules().find(1)), "unknown_change");
  EXPECT_EQ(change_of(rules().find(2)).rule, "rule2");
  const std::vector<std::int64_t> all = numbers(5000);
  ASSERT_EQ(all.size(), kMaxRuleChanges);
  EXPECT_EQ(all.front(), kMost + 1);
  EXPECT_EQ(all.back(), 2);
}

TEST_F(RuleHistoryTest, ARevertNamesItsChangeAlsoWhenThatIsDeleted) {
  fill(kMost);
  ASSERT_EQ(change_of(rules().append({"rule1", "", 0, 1, 1}, kMost)).reverts, 1);
  reopen();
  EXPECT_EQ(outcome(rules().find(1)), "unknown_change");
  EXPECT_EQ(newest().reverts, 1);
}

TEST_F(RuleHistoryTest, NumbersAreNotReused) {
  ASSERT_EQ(outcome(append("a")), "ok");
  ASSERT_EQ(outcome(append("b")), "ok");
  Db(path_).execute("DELETE FROM rule_change");
  reopen();
  EXPECT_EQ(change_of(append("c", 0)).number, 3);
}

TEST_F(RuleHistoryTest, AChangeThatFailsHalfWayLeavesNothing) {
  fill(kMost);
  Db(path_).execute("CREATE TRIGGER keep BEFORE DELETE ON rule_change BEGIN SELECT RAISE(ABORT, 'kept'); END");
  EXPECT_EQ(outcome(append("a")), "database_failed");
  EXPECT_EQ(newest().number, kMost);
  Db(path_).execute("DROP TRIGGER keep");
  EXPECT_EQ(change_of(append("a", kMost)).number, kMost + 1);
}

TEST_F(RuleHistoryTest, RefusesWhatIsTooLong) {
  const std::string rule(kMaxRuleBytes, 'r');
  const std::string options(kMaxRuleOptionsBytes, 'o');
  ASSERT_EQ(outcome(rules().append({rule, options, 0, 1, std::nullopt}, std::nullopt)), "ok");
  EXPECT_EQ(change_of(rules().find(1)).rule, rule);
  EXPECT_EQ(change_of(rules().find(1)).options, options);
  const auto long_rule = rules().append({rule + "r", options, 0, 1, std::nullopt}, std::nullopt);
  ASSERT_EQ(outcome(long_rule), "too_large");
  EXPECT_EQ(long_rule.error().detail, "the rule's name has 65 bytes, more than 64");
  const auto long_options = rules().append({rule, options + "o", 0, 1, std::nullopt}, std::nullopt);
  ASSERT_EQ(outcome(long_options), "too_large");
  EXPECT_EQ(long_options.error().detail, "the rule's options have 4097 bytes, more than 4096");
  EXPECT_EQ(rows(), 1);
}

TEST_F(RuleHistoryTest, ADamagedChangeIsNamedAndHidesNoOther) {
  ASSERT_EQ(change_of(append("first")).number, 1);
  const std::vector<std::pair<std::string, std::string>> damages{
      {"rule = hex(zeroblob(40))", "the rule's name has 80 bytes, more than 64"},
      {"options = hex(zeroblob(3000))", "the rule's options have 6000 bytes, more than 4096"}};
  std::vector<std::string> expected;
  for (const auto& [wrong, error] : damages) {
    const std::int64_t number = change_of(append("a")).number;
    Db(path_).execute(("UPDATE rule_change SET " + wrong + " WHERE id = " + std::to_string(number)).c_str());
    expected.insert(expected.begin(), std::to_string(number) + ": " + error);
    const auto found = rules().find(number);
    ASSERT_EQ(outcome(found), "database_corrupt") << wrong;
    EXPECT_EQ(found.error().detail, "rule change " + std::to_string(number) + " is damaged: " + error);
    EXPECT_EQ(damaged(1), std::vector<std::string>{expected.front()}) << wrong;
    EXPECT_TRUE(numbers(1).empty()) << "a damaged one counts among the newest";
  }
  EXPECT_EQ(newest().rule, "first");
  EXPECT_EQ(last().version, 3) << "a damaged change has its number all the same";
  EXPECT_EQ(texts(last().damaged), expected);
  EXPECT_EQ(numbers(5), std::vector<std::int64_t>{1});
  EXPECT_EQ(damaged(5), expected);

  EXPECT_EQ(outcome(append("b", 1)), "version_changed");
  EXPECT_EQ(change_of(append("b", 3)).number, 4);
  EXPECT_EQ(newest().rule, "b");
  EXPECT_TRUE(last().damaged.empty()) << "those below the one that counts are of no interest";
  EXPECT_EQ(numbers(5), (std::vector<std::int64_t>{4, 1}));
}

TEST_F(RuleHistoryTest, NumbersBelowOneAreDamageAndNoVersion) {
  Db(path_).execute("INSERT INTO rule_change VALUES (-7, 0, 'a', '', 0, 1, NULL)");
  EXPECT_EQ(last().change.has_value(), false);
  EXPECT_EQ(last().version, 0);
  EXPECT_EQ(texts(last().damaged), std::vector<std::string>{"-7: its number is below 1"});
  EXPECT_EQ(outcome(rules().find(-7)), "database_corrupt");
  EXPECT_EQ(outcome(append("a", 0)), "ok");
}

TEST_F(RuleHistoryTest, ValuesOfAnotherTypeAreDamage) {
  Db(path_).execute(
      "DROP TABLE rule_change; CREATE TABLE rule_change (id INTEGER PRIMARY KEY, changed_at, rule, "
      "options, uid, pid, reverts)");
  const std::vector<std::pair<std::string, std::string>> rows{
      {"'x','a','',0,1,NULL", "changed_at"}, {"0,5,'',0,1,NULL", "rule"},    {"0,'a',NULL,0,1,NULL", "options"},
      {"0,'a','',NULL,1,NULL", "uid"},       {"0,'a','',0,1.5,NULL", "pid"}, {"0,'a','',0,1,'x'", "reverts"}};
  for (const auto& [row, column] : rows) {
    Db(path_).execute(("INSERT OR REPLACE INTO rule_change VALUES (1," + row + ")").c_str());
    EXPECT_EQ(outcome(rules().find(1)), "database_corrupt") << row;
    EXPECT_EQ(damaged(1), std::vector<std::string>{"1: column " + column + " holds a value of the wrong type"});
    EXPECT_EQ(last().change.has_value(), false) << row;
  }
}

/// Long options lie on a page of their own.
TEST_F(RuleHistoryTest, ADamagedPageOfOneChangeCostsNoOther) {
  const std::string options(kMaxRuleOptionsBytes, 'o');
  ASSERT_EQ(outcome(append("a")), "ok");
  ASSERT_EQ(outcome(rules().append({"b", options, 0, 1, std::nullopt}, std::nullopt)), "ok");
  Db(path_).execute("PRAGMA wal_checkpoint(TRUNCATE)");
  const std::int64_t leaf = Db(path_).number("SELECT rootpage FROM sqlite_master WHERE name = 'rule_change'");
  const std::int64_t cell = Db(path_).number("SELECT pgoffset FROM dbstat WHERE name = 'rule_change' LIMIT 1");
  ASSERT_EQ(cell, (leaf - 1) * 4096) << "it still fits on its root page";
  store_.reset();
  {
    // The cell of the newest row was put below that of the first, and ends with the number of its next page.
    std::fstream file(path_, std::ios::in | std::ios::out | std::ios::binary);
    std::string page(4096, '\0');
    file.seekg(cell);
    file.read(page.data(), 4096);
    const std::size_t end = page.rfind("ooo") + 3;
    ASSERT_LT(end, page.size());
    file.seekp(cell + static_cast<std::streamoff>(end));
    file.write("\x7f\xff\xff\xff", 4);
  }
  reopen();
  EXPECT_EQ(newest().rule, "a");
  EXPECT_EQ(last().version, 2);
  EXPECT_EQ(damaged(5), std::vector<std::string>{"2: database disk image is malformed"});
}

TEST_F(RuleHistoryTest, ADamagedPageCostsTheHistoryOnly) {
  ASSERT_EQ(outcome(append("a")), "ok");
  ASSERT_TRUE(insert("m", test::fake_mesh(1, {10})).ok());
  Db(path_).execute("PRAGMA wal_checkpoint(TRUNCATE)");
  const std::int64_t page = Db(path_).number("SELECT rootpage FROM sqlite_master WHERE name = 'rule_change'");
  ASSERT_GT(page, 1);
  store_.reset();
  {
    std::fstream file(path_, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp((page - 1) * 4096);
    file.write("\xff\xff\xff\xff", 4);
  }
  reopen();
  EXPECT_EQ(outcome(rules().last()), "database_corrupt");
  EXPECT_EQ(outcome(rules().newest(5)), "database_corrupt");
  EXPECT_EQ(outcome(rules().find(1)), "database_corrupt");
  EXPECT_EQ(outcome(append("b")), "database_corrupt");
  EXPECT_EQ(outcome(append("b", 1)), "database_corrupt");
  expect_equal("m", test::fake_mesh(1, {10}));
}

TEST_F(RuleHistoryTest, AMissingTableIsAnError) {
  Db(path_).execute("DROP TABLE rule_change");
  EXPECT_EQ(outcome(rules().last()), "database_failed");
  EXPECT_EQ(outcome(append("a")), "database_failed");
  EXPECT_EQ(outcome(MeshStore::open(path_)), "database_failed");
}

}  // namespace
}  // namespace pmcd::store
