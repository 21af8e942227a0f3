/// Database: one SQLite connection behind a lock, in WAL mode with full sync. The only user of
/// SQLite.
///
/// Errors: kNoSpace when the disk is full; otherwise kInternal with SQLite's message (a damaged
/// page, an unreadable file); `where` is the path of the database.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/base/mutex.h"
#include "core/base/result.h"
#include "server/store/database_mark.h"
#include "server/store/disk_reserve.h"

struct sqlite3;
struct sqlite3_stmt;

namespace server {

/// Prepared statements that are not in use: to prepare one takes longer than to run it.
class StatementPool {
 public:
  /// Prepares the text, unless it is there.
  int take(sqlite3* db, const char* sql, sqlite3_stmt*& statement);
  /// Keeps it without its parameters, or finalizes it.
  void give_back(sqlite3_stmt* statement);
  void clear();

 private:
  std::map<std::string, sqlite3_stmt*, std::less<>> kept_;  ///< By text; null: in use.
};

/// One prepared statement. The first failure is kept: bind, step and read, then check status()
/// once.
class Statement {
 public:
  Statement(sqlite3* db, StatementPool& pool, const char* sql, std::string path);
  Statement(Statement&& other) noexcept;
  Statement& operator=(Statement&&) = delete;
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;
  ~Statement();

  /// Binds the next parameter, from left to right. The text is copied.
  Statement& bind(std::int64_t value);
  Statement& bind(double value);
  Statement& bind(std::string_view value);
  Statement& bind(std::optional<double> value);

  /// Returns true when there is a row to read; false at the end and after a failure.
  bool step();
  /// Steps once; for statements without rows.
  core::Status run();
  core::Status status() const;
  /// Returns the value, or the first failure.
  template <typename T>
  core::Result<T> result(T value) const {
    if (const auto ended = status(); !ended) {
      return ended.error();
    }
    return value;
  }
  /// Reads all rows: read(*this) returns the value of one.
  template <typename Read>
  auto rows(const Read& read) {
    std::vector<std::invoke_result_t<const Read&, const Statement&>> values;
    while (step()) {
      values.push_back(read(std::as_const(*this)));
    }
    return result(std::move(values));
  }

  /// Columns of the row, counted from 0.
  std::int64_t integer(int column) const;
  double real(int column) const;
  std::string text(int column) const;
  std::optional<double> optional_real(int column) const;

 private:
  void check(int code);
  sqlite3* db_;
  StatementPool* pool_;
  sqlite3_stmt* statement_ = nullptr;
  int bound_ = 0;
  int failure_ = 0;
  std::string message_;
  std::string path_;
};

class Database {
 public:
  /// Opens or creates the file. Errors: the file is not a database, or was written by a newer
  /// version.
  static core::Result<std::unique_ptr<Database>> open(const std::string& path);
  /// Returns what is known to be lost or damaged, in sentences; empty: nothing (DatabaseMark).
  const std::string& damage() const { return damage_; }
  /// Writes the log back to the database and empties it.
  core::Status checkpoint();
  ~Database();
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  /// Holds the connection for as long as this object lives: a few lines, never while calling out.
  class Session {
   public:
    Statement prepare(const char* sql) {
      return Statement(db_->handle_, db_->statements_, sql, db_->path_);
    }
    /// Runs statements without parameters and rows.
    core::Status execute(const char* sql);
    std::int64_t last_row_id() const;
    std::int64_t changes() const;
    /// Returns the number of rows changed since the database was opened.
    std::int64_t total_changes() const;

   private:
    friend class Database;
    explicit Session(Database& db) : db_(&db), lock_(db.mutex_) {}
    Database* db_;
    std::unique_lock<core::Mutex> lock_;
  };
  Session session() { return Session(*this); }

  /// Space that a transaction may use on a full disk. Transactions that only add to the store leave
  /// the reserve to changes and deletions.
  enum class Spend : std::uint8_t { kReserve, kFreeSpace };
  DiskReserve& reserve() { return reserve_; }

  /// Runs BEGIN, `work(session)`, COMMIT; all of it or nothing. On a full disk, retries with the
  /// reserve.
  template <typename Work>
  core::Status transact(const Work& work, Spend spend = Spend::kReserve) {
    if (spend == Spend::kFreeSpace && !reserve_.take()) {
      return core::Error{core::ErrorCode::kNoSpace, "the disk is full", path_};
    }
    Session session(*this);
    core::Status done = commit(session, work);
    const bool is_full = !done && done.error().code == core::ErrorCode::kNoSpace;
    if (is_full && spend == Spend::kReserve) {
      const DiskReserve::Spending spending(reserve_);
      done = make_room(session) ? commit(session, work) : done;
    }
    return done;
  }

 private:
  template <typename Work>
  static core::Status commit(Session& session, const Work& work) {
    if (auto begun = session.prepare("BEGIN IMMEDIATE").run(); !begun) {
      return begun;
    }
    core::Status done = work(session);
    if (done) {
      done = session.prepare("COMMIT").run();
    }
    if (!done) {
      static_cast<void>(session.prepare("ROLLBACK").run());
    }
    return done;
  }
  bool make_room(Session& session);
  core::Status checkpoint(Session& session);
  /// Notes that the log has `pages` valid pages.
  void note_commit(int pages);
  /// Called by SQLite after each commit.
  static int on_commit(void* self, sqlite3* handle, const char* name, int pages);

  Database(sqlite3* handle, std::string path, std::string damage)
      : handle_(handle),
        path_(std::move(path)),
        reserve_(path_ + "-reserve"),
        mark_(path_),
        damage_(std::move(damage)) {}
  sqlite3* handle_;
  StatementPool statements_;  ///< Of sessions, which hold mutex_.
  std::string path_;
  DiskReserve reserve_;
  DatabaseMark mark_;
  const std::string damage_;
  core::Mutex mutex_;
};

}  // namespace server
