// SPDX-License-Identifier: MIT
// The statements and what is made of their rows.
#include "daemon/store/rule_history.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "daemon/store/db.h"
#include "daemon/store/guarded.h"
#include "daemon/store/wall_clock.h"

namespace pmcd::store {
namespace {

constexpr const char* kSelect = "SELECT id, changed_at, rule, options, uid, pid, reverts FROM rule_change ";

std::size_t rule_bytes(const std::optional<std::string>& rule) {
  return rule ? rule->size() : 0;
}

/// Throws SqliteError, database_corrupt when the row holds what append() never writes.
RuleChange read_change(const Statement& row) {
  RuleChange change;
  change.number = row.integer(0);
  change.changed_at = row.integer(1);
  change.rule = row.text_or_null(2);
  change.options = row.text(3);
  change.uid = row.integer(4);
  change.pid = row.integer(5);
  change.reverts = row.integer_or_null(6);
  const bool fits = rule_bytes(change.rule) <= kMaxRuleBytes && change.options.size() <= kMaxRuleOptionsBytes;
  if (!fits || change.number < 1) {
    throw SqliteError(SQLITE_CORRUPT, "rule change " + std::to_string(change.number) + " is not as pmcd wrote it");
  }
  return change;
}

Status check_sizes(const NewRuleChange& change) {
  if (const std::size_t bytes = rule_bytes(change.rule); bytes > kMaxRuleBytes) {
    return Error{ErrorCode::too_large,
                 "the rule's name has " + std::to_string(bytes) + " bytes, more than " + std::to_string(kMaxRuleBytes)};
  }
  if (const std::size_t bytes = change.options.size(); bytes > kMaxRuleOptionsBytes) {
    return Error{ErrorCode::too_large, "the rule's options have " + std::to_string(bytes) + " bytes, more than " +
                                           std::to_string(kMaxRuleOptionsBytes)};
  }
  return Done{};
}

Error version_changed(std::int64_t version, std::int64_t expected) {
  return {ErrorCode::version_changed,
          "the rule has version " + std::to_string(version) + ", not " + std::to_string(expected)};
}

}  // namespace

struct RuleHistory::Statements {
  explicit Statements(Db& db)
      : version(db, "SELECT id FROM rule_change ORDER BY id DESC LIMIT 1"),
        insert(db, "INSERT INTO rule_change (changed_at, rule, options, uid, pid, reverts) VALUES (?1,?2,?3,?4,?5,?6)"),
        trim(db, "DELETE FROM rule_change WHERE id <= (SELECT id FROM rule_change ORDER BY id DESC LIMIT 1 OFFSET ?1)"),
        find(db, std::string(kSelect) + "WHERE id = ?1"),
        newest(db, std::string(kSelect) + "ORDER BY id DESC LIMIT ?1") {}

  Statement version;
  Statement insert;
  Statement trim;
  Statement find;
  Statement newest;
};

RuleHistory::RuleHistory(Db& db) : db_(db), statements_(std::make_unique<Statements>(db)) {}

RuleHistory::~RuleHistory() = default;

Result<RuleChange> RuleHistory::append(NewRuleChange change, std::optional<std::int64_t> if_version) {
  if (const Status status = check_sizes(change); !status.ok()) return status.error();
  return guarded([&]() -> Result<RuleChange> {
    RuleChange row;
    row.changed_at = seconds_since_1970();
    row.rule = std::move(change.rule);
    row.options = std::move(change.options);
    row.uid = change.uid;
    row.pid = change.pid;
    row.reverts = change.reverts;
    Transaction transaction(db_);
    if (if_version) {
      if (const std::int64_t now = version(); now != *if_version) return version_changed(now, *if_version);
    }
    Statement& insert = statements_->insert;
    insert.bind(1, row.changed_at).bind(3, std::string_view(row.options)).bind(4, row.uid).bind(5, row.pid);
    row.rule ? insert.bind(2, std::string_view(*row.rule)) : insert.bind_null(2);
    row.reverts ? insert.bind(6, *row.reverts) : insert.bind_null(6);
    insert.run();
    row.number = db_.last_insert_id();
    statements_->trim.bind(1, static_cast<std::int64_t>(kMaxRuleChanges)).run();
    transaction.commit();
    return row;
  });
}

Result<std::optional<RuleChange>> RuleHistory::newest() {
  return guarded([&]() -> Result<std::optional<RuleChange>> {
    std::vector<RuleChange> changes = read_newest(1);
    if (changes.empty()) return std::optional<RuleChange>();
    return std::optional<RuleChange>(std::move(changes.front()));
  });
}

Result<std::vector<RuleChange>> RuleHistory::newest(std::size_t most) {
  return guarded([&]() -> Result<std::vector<RuleChange>> { return read_newest(most); });
}

Result<RuleChange> RuleHistory::find(std::int64_t number) {
  return guarded([&]() -> Result<RuleChange> {
    Statement& query = statements_->find;
    const ResetAtExit guard(query);
    if (query.bind(1, number).step()) return read_change(query);
    return Error{ErrorCode::unknown_change, "there is no rule change " + std::to_string(number)};
  });
}

std::int64_t RuleHistory::version() {
  Statement& query = statements_->version;
  const ResetAtExit guard(query);
  return query.step() ? query.integer(0) : 0;
}

std::vector<RuleChange> RuleHistory::read_newest(std::size_t most) {
  Statement& query = statements_->newest;
  const ResetAtExit guard(query);
  query.bind(1, static_cast<std::int64_t>(std::min(most, kMaxRuleChanges)));
  std::vector<RuleChange> changes;
  while (query.step()) changes.push_back(read_change(query));
  return changes;
}

}  // namespace pmcd::store
