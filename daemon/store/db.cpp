// SPDX-License-Identifier: MIT
// The thin layer over SQLite's C calls. It knows no table of pmcd.
#include "daemon/store/db.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace pmcd::store {
namespace {

constexpr int kBusyMilliseconds = 2000;

ErrorCode error_code(int extended_code, int system_error) {
  switch (extended_code & 0xff) {
    case SQLITE_FULL:
      return ErrorCode::no_space;
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return ErrorCode::database_locked;
    case SQLITE_CORRUPT:
      return ErrorCode::database_corrupt;
    case SQLITE_NOTADB:
      return ErrorCode::not_a_database;
    case SQLITE_TOOBIG:
      return ErrorCode::too_large;
    case SQLITE_NOMEM:
      return ErrorCode::out_of_memory;
    case SQLITE_IOERR:
    case SQLITE_CANTOPEN:
      // SQLite says FULL only where it writes the database or its log; elsewhere (the -shm file, a quota, a limit on
      // file sizes) the reason stands in errno alone.
      if (system_error == ENOSPC || system_error == EDQUOT || system_error == EFBIG) return ErrorCode::no_space;
      if (system_error == ENOMEM) return ErrorCode::out_of_memory;
      return ErrorCode::database_failed;
    default:
      return ErrorCode::database_failed;
  }
}

/// The errno of the last failed call on the write-ahead log, 0 if there is none. sqlite3_system_errno() does not know
/// it any more when the failed write was that of a COMMIT.
int log_errno(sqlite3* db) {
  sqlite3_file* log = nullptr;
  int number = 0;
  const int code = sqlite3_file_control(db, "main", SQLITE_FCNTL_JOURNAL_POINTER, static_cast<void*>(&log));
  if (code != SQLITE_OK || log == nullptr || log->pMethods == nullptr) return 0;
  return log->pMethods->xFileControl(log, SQLITE_FCNTL_LAST_ERRNO, &number) == SQLITE_OK ? number : 0;
}

/// What SQLite's own words leave open.
const char* in_plain_words(ErrorCode code) {
  switch (code) {
    case ErrorCode::no_space:
      return "the disk of the database is full: ";
    case ErrorCode::database_locked:
      return "another process keeps the database locked: ";
    case ErrorCode::database_corrupt:
      return "the database is damaged: ";
    default:
      return "";
  }
}

}  // namespace

Error SqliteError::as_error() const {
  const ErrorCode code = error_code(extended_code_, system_error_);
  return {code, std::string(in_plain_words(code)) + what()};
}

Db::Db(const std::string& path) {
  // SQLite would make the file readable by all; making it first fixes its mode (and that of -wal and -shm, which
  // follow). Only a new file: closing a descriptor of an existing database would drop locks that this process holds on
  // it.
  const int fd = ::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0640);
  if (fd >= 0) {
    ::close(fd);
  } else if (errno != EEXIST) {
    throw SqliteError(SQLITE_CANTOPEN, path + ": " + std::strerror(errno), errno);
  }
  sqlite3* raw = nullptr;
  const int code = sqlite3_open_v2(path.c_str(), &raw, SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOMUTEX, nullptr);
  handle_.reset(raw);
  if (raw == nullptr) throw SqliteError(SQLITE_NOMEM, "out of memory while opening " + path);
  if (code != SQLITE_OK) {
    throw SqliteError(sqlite3_extended_errcode(raw), path + ": " + sqlite3_errmsg(raw), sqlite3_system_errno(raw));
  }
  check(sqlite3_extended_result_codes(raw, 1));
  check(sqlite3_busy_timeout(raw, kBusyMilliseconds));
}

void Db::check(int code) const {
  if (code != SQLITE_OK) throw last_error();
}

SqliteError Db::last_error() const {
  sqlite3* const db = handle_.get();
  const int code = sqlite3_extended_errcode(db);
  return {code, sqlite3_errmsg(db), code == SQLITE_IOERR_WRITE ? log_errno(db) : sqlite3_system_errno(db)};
}

void Db::execute(const char* sql) {
  check(sqlite3_exec(handle_.get(), sql, nullptr, nullptr, nullptr));
}

std::int64_t Db::number(const char* sql) {
  Statement statement(*this, sql);
  return statement.step() ? statement.integer(0) : 0;
}

std::string Db::text(const char* sql) {
  Statement statement(*this, sql);
  return statement.step() ? statement.text(0) : std::string();
}

Statement::Statement(Db& db, std::string_view sql) : db_(&db) {
  sqlite3_stmt* raw = nullptr;
  db.check(sqlite3_prepare_v3(db.handle(), sql.data(), static_cast<int>(sql.size()), SQLITE_PREPARE_PERSISTENT, &raw,
                              nullptr));
  if (raw == nullptr) throw SqliteError(SQLITE_ERROR, "empty SQL statement");
  statement_.reset(raw);
}

Statement& Statement::bind(int parameter, std::int64_t value) {
  db_->check(sqlite3_bind_int64(statement_.get(), parameter, value));
  return *this;
}

Statement& Statement::bind(int parameter, double value) {
  db_->check(sqlite3_bind_double(statement_.get(), parameter, value));
  return *this;
}

Statement& Statement::bind(int parameter, std::string_view value) {
  db_->check(sqlite3_bind_text64(statement_.get(), parameter, value.data(), value.size(), SQLITE_STATIC, SQLITE_UTF8));
  return *this;
}

Statement& Statement::bind(int parameter, std::span<const std::byte> value) {
  db_->check(sqlite3_bind_blob64(statement_.get(), parameter, value.data(), value.size(), SQLITE_STATIC));
  return *this;
}

Statement& Statement::bind_null(int parameter) {
  db_->check(sqlite3_bind_null(statement_.get(), parameter));
  return *this;
}

bool Statement::step() {
  const int code = sqlite3_step(statement_.get());
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  throw db_->last_error();
}

void Statement::run() {
  const ResetAtExit guard(*this);
  while (step()) {
  }
}

void Statement::reset() {
  // The code of sqlite3_reset repeats the error of the last step, which step() has reported.
  sqlite3_reset(statement_.get());
  sqlite3_clear_bindings(statement_.get());
}

bool Statement::is_null(int column) const {
  return sqlite3_column_type(statement_.get(), column) == SQLITE_NULL;
}

void Statement::expect_type(int column, int type) const {
  if (sqlite3_column_type(statement_.get(), column) == type) return;
  throw SqliteError(SQLITE_CORRUPT, std::string("column ") + sqlite3_column_name(statement_.get(), column) +
                                        " holds a value of the wrong type");
}

std::int64_t Statement::integer(int column) const {
  expect_type(column, SQLITE_INTEGER);
  return sqlite3_column_int64(statement_.get(), column);
}

std::optional<std::int64_t> Statement::integer_or_null(int column) const {
  if (is_null(column)) return std::nullopt;
  return integer(column);
}

double Statement::real(int column) const {
  expect_type(column, SQLITE_FLOAT);
  return sqlite3_column_double(statement_.get(), column);
}

std::optional<double> Statement::real_or_null(int column) const {
  if (is_null(column)) return std::nullopt;
  return real(column);
}

std::string Statement::text(int column) const {
  expect_type(column, SQLITE_TEXT);
  const auto* bytes = reinterpret_cast<const char*>(sqlite3_column_text(statement_.get(), column));
  if (bytes == nullptr) throw SqliteError(SQLITE_NOMEM, "out of memory");
  return {bytes, static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column))};
}

std::optional<std::string> Statement::text_or_null(int column) const {
  if (is_null(column)) return std::nullopt;
  return text(column);
}

std::vector<std::byte> Statement::blob(int column) const {
  expect_type(column, SQLITE_BLOB);
  const auto* bytes = static_cast<const std::byte*>(sqlite3_column_blob(statement_.get(), column));
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column));
  if (bytes == nullptr && size != 0) throw SqliteError(SQLITE_NOMEM, "out of memory");
  return {bytes, bytes + size};
}

Transaction::Transaction(Db& db) : db_(db) {
  db_.execute("BEGIN IMMEDIATE");
}

Transaction::~Transaction() {
  // An error may have rolled back already; then this one fails, and that is right.
  if (open_) sqlite3_exec(db_.handle(), "ROLLBACK", nullptr, nullptr, nullptr);
}

void Transaction::commit() {
  db_.execute("COMMIT");
  open_ = false;
}

}  // namespace pmcd::store
