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

std::size_t rule_bytes(const std::optional<std::string>& rule) {
  return rule ? rule->size() : 0;
}

Status check_sizes(const std::optional<std::string>& rule, const std::string& options) {
  if (const std::size_t bytes = rule_bytes(rule); bytes > kMaxRuleBytes) {
    return Error{ErrorCode::too_large,
                 "the rule's name has " + std::to_string(bytes) + " bytes, more than " + std::to_string(kMaxRuleBytes)};
  }
  if (const std::size_t bytes = options.size(); bytes > kMaxRuleOptionsBytes) {
    return Error{ErrorCode::too_large, "the rule's options have " + std::to_string(bytes) + " bytes, more than " +
                                           std::to_string(kMaxRuleOptionsBytes)};
  }
  return Done{};
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
  if (change.number < 1) throw SqliteError(SQLITE_CORRUPT, "its number is below 1");
  if (const Status status = check_sizes(change.rule, change.options); !status.ok()) {
    throw SqliteError(SQLITE_CORRUPT, status.error().detail);
  }
  return change;
}

Error version_changed(std::int64_t version, std::int64_t expected) {
  return {ErrorCode::version_changed,
          "the rule has version " + std::to_string(version) + ", not " + std::to_string(expected)};
}

}  // namespace

struct RuleHistory::Statements {
  explicit Statements(Db& db)
      : version(db, "SELECT id FROM rule_change WHERE id > 0 ORDER BY id DESC LIMIT 1"),
        insert(db, "INSERT INTO rule_change (changed_at, rule, options, uid, pid, reverts) VALUES (?1,?2,?3,?4,?5,?6)"),
        trim(db, "DELETE FROM rule_change WHERE id <= (SELECT id FROM rule_change ORDER BY id DESC LIMIT 1 OFFSET ?1)"),
        numbers(db, "SELECT id FROM rule_change ORDER BY id DESC LIMIT ?1"),
        find(db, "SELECT id, changed_at, rule, options, uid, pid, reverts FROM rule_change WHERE id = ?1") {}

  Statement version;
  Statement insert;
  Statement trim;
  Statement numbers;
  Statement find;
};

RuleHistory::RuleHistory(Db& db) : db_(db), statements_(std::make_unique<Statements>(db)) {}

RuleHistory::~RuleHistory() = default;

Result<RuleChange> RuleHistory::append(NewRuleChange change, std::optional<std::int64_t> if_version) {
  if (const Status status = check_sizes(change.rule, change.options); !status.ok()) return status.error();
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

Result<LastChange> RuleHistory::last() {
  return guarded([&]() -> Result<LastChange> {
    LastChange last;
    last.version = version();
    for (const std::int64_t number : numbers(kMaxRuleChanges)) {
      auto change = read(number);
      if (!change) continue;
      if (change->ok()) {
        last.change = std::move(*change).value();
        break;
      }
      last.damaged.push_back({number, change->error().detail});
    }
    return last;
  });
}

Result<RuleChanges> RuleHistory::newest(std::size_t most) {
  return guarded([&]() -> Result<RuleChanges> {
    RuleChanges found;
    for (const std::int64_t number : numbers(std::min(most, kMaxRuleChanges))) {
      auto change = read(number);
      if (!change) continue;
      if (change->ok()) {
        found.changes.push_back(std::move(*change).value());
      } else {
        found.damaged.push_back({number, change->error().detail});
      }
    }
    return found;
  });
}

Result<RuleChange> RuleHistory::find(std::int64_t number) {
  return guarded([&]() -> Result<RuleChange> {
    auto change = read(number);
    if (!change) return Error{ErrorCode::unknown_change, "there is no rule change " + std::to_string(number)};
    if (change->ok()) return std::move(*change);
    return Error{change->error().code,
                 "rule change " + std::to_string(number) + " is damaged: " + change->error().detail};
  });
}

std::int64_t RuleHistory::version() {
  Statement& query = statements_->version;
  const ResetAtExit guard(query);
  return query.step() ? query.integer(0) : 0;
}

/// The numbers alone: a row is read by itself, so that a damaged one ends no walk over the others.
std::vector<std::int64_t> RuleHistory::numbers(std::size_t most) {
  Statement& query = statements_->numbers;
  const ResetAtExit guard(query);
  query.bind(1, static_cast<std::int64_t>(most));
  std::vector<std::int64_t> numbers;
  while (query.step()) numbers.push_back(query.integer(0));
  return numbers;
}

/// None if there is no such row; its error is database_corrupt, in words that say what is wrong with it. Throws what
/// else goes wrong.
std::optional<Result<RuleChange>> RuleHistory::read(std::int64_t number) {
  Statement& query = statements_->find;
  const ResetAtExit guard(query);
  try {
    if (query.bind(1, number).step()) return read_change(query);
    return std::nullopt;
  } catch (const SqliteError& error) {
    const ErrorCode code = error.as_error().code;
    if (code != ErrorCode::database_corrupt) throw;
    return Error{code, error.what()};
  }
}

}  // namespace pmcd::store
