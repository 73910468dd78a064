// SPDX-License-Identifier: MIT
// SQLite with owners: a connection, a statement, a transaction, each one class. Thread rule: one connection per thread;
// a Db and everything made from it is used by the thread that opened it and by no other.
// An error of SQLite is thrown as SqliteError inside this room; MeshStore turns it into a value at its boundary.
#pragma once

#include <sqlite3.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/store/result.h"

namespace pmcd::store {

class SqliteError : public std::runtime_error {
 public:
  /// `system_error`: the errno behind it, 0 if there is none.
  SqliteError(int extended_code, const std::string& message, int system_error = 0)
      : std::runtime_error(message), extended_code_(extended_code), system_error_(system_error) {}
  /// The error as the store reports it: a code, and a sentence that an operator understands.
  [[nodiscard]] Error as_error() const;

 private:
  int extended_code_;
  int system_error_;
};

/// One connection.
class Db {
 public:
  /// Opens the file, or makes it (readable and writable by its owner and group only). Throws SqliteError.
  explicit Db(const std::string& path);

  /// Runs SQL text of one or more statements that return no rows. Throws SqliteError.
  void execute(const char* sql);
  /// The first column of the first row of `sql` as a number; 0 if there is no row. Throws SqliteError.
  std::int64_t number(const char* sql);
  /// The same as text; empty if there is no row.
  std::string text(const char* sql);

  [[nodiscard]] std::int64_t last_insert_id() const { return sqlite3_last_insert_rowid(handle_.get()); }
  /// Rows that the last INSERT, UPDATE or DELETE touched.
  [[nodiscard]] int changes() const { return sqlite3_changes(handle_.get()); }
  [[nodiscard]] sqlite3* handle() const { return handle_.get(); }

  /// Throws SqliteError with this connection's message unless `code` is SQLITE_OK.
  void check(int code) const;
  /// The connection's last error.
  [[nodiscard]] SqliteError last_error() const;

 private:
  struct Close {
    void operator()(sqlite3* handle) const { sqlite3_close_v2(handle); }
  };
  std::unique_ptr<sqlite3, Close> handle_;
};

/// One prepared statement, which may run many times: bind, step through the rows, reset. REQUIRES: the Db outlives it.
class Statement {
 public:
  /// Throws SqliteError, also when `sql` is not exactly one statement.
  Statement(Db& db, std::string_view sql);

  /// Parameters count from 1. The bytes of text and blobs must stay as they are until reset(). Throw SqliteError.
  Statement& bind(int parameter, std::int64_t value);
  Statement& bind(int parameter, double value);
  Statement& bind(int parameter, std::string_view value);
  Statement& bind(int parameter, std::span<const std::byte> value);
  Statement& bind_null(int parameter);

  /// The next row: true if there is one, false at the end. Throws SqliteError.
  bool step();
  /// Runs a statement that returns no rows, then resets it. Throws SqliteError.
  void run();
  /// Ready for the next run; bindings are cleared.
  void reset();

  /// Columns count from 0 and are valid until the next step() or reset(). A column of another type than asked for
  /// throws SqliteError (database corrupt): a damaged file must not become a wrong value.
  [[nodiscard]] std::int64_t integer(int column) const;
  [[nodiscard]] std::optional<std::int64_t> integer_or_null(int column) const;
  [[nodiscard]] double real(int column) const;
  [[nodiscard]] std::optional<double> real_or_null(int column) const;
  [[nodiscard]] std::string text(int column) const;
  [[nodiscard]] std::optional<std::string> text_or_null(int column) const;
  [[nodiscard]] std::vector<std::byte> blob(int column) const;

 private:
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
  };
  [[nodiscard]] bool is_null(int column) const;
  void expect_type(int column, int type) const;

  Db* db_;
  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
};

/// Resets a statement when a function is left, so that no read stays open between two calls.
class ResetAtExit {
 public:
  explicit ResetAtExit(Statement& statement) : statement_(statement) {}
  ResetAtExit(const ResetAtExit&) = delete;
  ResetAtExit& operator=(const ResetAtExit&) = delete;
  ~ResetAtExit() { statement_.reset(); }

 private:
  Statement& statement_;
};

/// A write transaction: takes the write lock at once and rolls back unless commit() was reached.
class Transaction {
 public:
  /// Throws SqliteError.
  explicit Transaction(Db& db);
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  ~Transaction();

  /// Once it returns, what was written survives a loss of power. Throws SqliteError, and then nothing was written.
  void commit();

 private:
  Db& db_;
  bool open_ = true;
};

}  // namespace pmcd::store
