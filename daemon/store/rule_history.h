// SPDX-License-Identifier: MIT
// The history of the distribution rule's live changes, in the mesh database, so that a change survives a restart. The
// number of the newest change is the version of the policy in force. It knows no rule: names and options are text to
// it, kept as the caller gives them. Thread rule: that of the MeshStore that it belongs to (mesh_store.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/store/result.h"

namespace pmcd::store {

/// One change.
struct RuleChange {
  std::int64_t number = 0;          ///< from 1, ascending, never reused
  std::int64_t changed_at = 0;      ///< seconds since 1970
  std::optional<std::string> rule;  ///< nothing: no live rule any more, the configuration decides
  std::string options;              ///< "name=value name=value" in ascending order of names; empty: none
  std::int64_t uid = 0;             ///< of who asked for it
  std::int64_t pid = 0;
  std::optional<std::int64_t> reverts;  ///< the change that this one went back to; may be deleted by now
};

/// What is to be appended; members as in RuleChange. `reverts` is not looked up.
struct NewRuleChange {
  std::optional<std::string> rule;
  std::string options;
  std::int64_t uid = 0;
  std::int64_t pid = 0;
  std::optional<std::int64_t> reverts;
};

/// A change whose row holds what append() never writes, or cannot be read.
struct DamagedChange {
  std::int64_t number = 0;
  std::string error;  ///< what is wrong with it, in plain words
};

/// Both newest first.
struct RuleChanges {
  std::vector<RuleChange> changes;
  std::vector<DamagedChange> damaged;  ///< what `changes` lacks therefore
};

/// What a start goes by.
struct LastChange {
  std::int64_t version = 0;            ///< number of the newest change, damaged or not; 0: there was none
  std::optional<RuleChange> change;    ///< the newest that is whole
  std::vector<DamagedChange> damaged;  ///< those that are newer than it, newest first
};

inline constexpr std::size_t kMaxRuleBytes = 64;
inline constexpr std::size_t kMaxRuleOptionsBytes = 4096;
/// Older ones are deleted.
inline constexpr std::size_t kMaxRuleChanges = 1'000;

class Db;

class RuleHistory {
 public:
  /// REQUIRES: the Db is prepared (schema.h) and outlives it. Throws SqliteError.
  explicit RuleHistory(Db& db);
  ~RuleHistory();
  RuleHistory(const RuleHistory&) = delete;
  RuleHistory& operator=(const RuleHistory&) = delete;

  /// Gives the change the next number and the present time, and deletes what is older than the newest kMaxRuleChanges;
  /// once this returns, it is on the disk. With `if_version` only if the newest change has this number, 0 for none. On
  /// error nothing changed. Older changes may be damaged. Cost: one commit and a walk over kMaxRuleChanges rows.
  /// Errors: too_large (rule or options), version_changed, no_space, and those of SQLite.
  Result<RuleChange> append(NewRuleChange change, std::optional<std::int64_t> if_version);

  /// A damaged change hides no other. Errors: those of SQLite, database_corrupt among them when not even the numbers
  /// can be read. [a row, and one for each damaged change that is newer]
  Result<LastChange> last();
  /// The newest, at most so many, damaged ones counted. Errors: those of last().
  Result<RuleChanges> newest(std::size_t most);
  /// Errors: unknown_change, database_corrupt (this change is damaged; the text names it), and those of SQLite.
  Result<RuleChange> find(std::int64_t number);

 private:
  struct Statements;

  std::int64_t version();
  std::vector<std::int64_t> numbers(std::size_t most);
  std::optional<Result<RuleChange>> read(std::int64_t number);

  Db& db_;
  std::unique_ptr<Statements> statements_;
};

}  // namespace pmcd::store
