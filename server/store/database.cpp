#include "server/store/database.h"

#include <array>
#include <cerrno>
#include <cstddef>
#include <utility>

#include <fcntl.h>
#include <sqlite3.h>
#include <sys/stat.h>

#include "core/base/byte_order.h"
#include "server/store/files.h"
#include "server/store/schema.h"

namespace server {

using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

/// The texts in this folder are fewer; those of lists depend on what is asked for.
constexpr std::size_t kKeptStatements = 128;

bool is_full(int number) { return number == ENOSPC || number == EDQUOT || number == EFBIG; }

/// number: errno of the failed call, for results of SQLite that only report failure.
Error sqlite_error(int code, const std::string& message, const std::string& path, int number = 0) {
  const int primary = code & 0xff;
  if (primary == SQLITE_FULL || (primary == SQLITE_IOERR && is_full(number))) {
    return Error{ErrorCode::kNoSpace, "the disk is full", path};
  }
  if (primary == SQLITE_CORRUPT && number == EIO) {  // SQLite takes a failed read for damage.
    return Error{ErrorCode::kInternal, "database error: the disk could not read it", path};
  }
  std::string words = "database error: " + message;
  if (primary == SQLITE_CORRUPT || primary == SQLITE_NOTADB) {
    words += "; restore it from a backup, or start with another --data directory";
  }
  return Error{ErrorCode::kInternal, std::move(words), path};
}

/// Returns whether the database has a log, or a journal of the change that makes it one with a log:
/// SQLite plays it back.
bool has_journal(const std::string& path) {
  for (const char* kind : {"-wal", "-journal"}) {
    if (const auto file = open_file(path + kind, O_RDONLY)) {
      const auto bytes = file_bytes(file->get(), path);
      if (!bytes || *bytes > 0) {
        return true;
      }
    }
  }
  return false;
}

/// SQLite reads missing pages of a cut file as zeros. The file's header holds the number of pages,
/// which is correct when no journal is left to play back. Source: "Database File Format", 1.3: page
/// size at 16, pages at 28, big-endian.
Status check_not_cut(const std::string& path) {
  if (has_journal(path)) {
    return core::ok_status();
  }
  const auto file = open_file(path, O_RDONLY);
  if (!file) {
    return file.error().code == ErrorCode::kNotFound ? core::ok_status() : Status(file.error());
  }
  std::array<std::byte, 32> head{};
  const auto bytes = file_bytes(file->get(), path);
  const auto got = read_at(file->get(), head, 0, path);
  if (!bytes || !got) {
    return bytes ? got.error() : bytes.error();
  }
  if (*bytes == 0) {
    return core::ok_status();
  }
  const std::uint64_t page_bytes = core::u16_big(head, 16) == 1 ? 65536 : core::u16_big(head, 16);
  if (*got < head.size() || *bytes < core::u32_big(head, 28) * page_bytes) {
    return sqlite_error(SQLITE_CORRUPT, "the file is cut short", path);
  }
  return core::ok_status();
}

/// Returns errno of the failed call. SQLite clears that of a write at once, and has none for what
/// it takes for damage, but keeps both in its file objects.
int errno_of(sqlite3* db, int code) {
  const int number = sqlite3_system_errno(db);
  const bool is_corrupt = (code & 0xff) == SQLITE_CORRUPT;
  if (is_full(number) || !(code == SQLITE_IOERR_WRITE || is_corrupt)) {
    return number;
  }
  for (const int which : {SQLITE_FCNTL_JOURNAL_POINTER, SQLITE_FCNTL_FILE_POINTER}) {
    sqlite3_file* file = nullptr;
    int last = 0;
    if (sqlite3_file_control(db, "main", which, static_cast<void*>(&file)) == SQLITE_OK &&
        file != nullptr && file->pMethods != nullptr &&
        file->pMethods->xFileControl(file, SQLITE_FCNTL_LAST_ERRNO, &last) == SQLITE_OK &&
        (is_corrupt ? last == EIO : is_full(last))) {
      return last;
    }
  }
  return number;
}

}  // namespace

int StatementPool::take(sqlite3* db, const char* sql, sqlite3_stmt*& statement) {
  if (const auto kept = kept_.find(std::string_view(sql)); kept != kept_.end() && kept->second) {
    statement = std::exchange(kept->second, nullptr);
    return SQLITE_OK;
  }
  return sqlite3_prepare_v3(db, sql, -1, SQLITE_PREPARE_PERSISTENT, &statement, nullptr);
}

void StatementPool::give_back(sqlite3_stmt* statement) {
  const char* sql = statement == nullptr ? nullptr : sqlite3_sql(statement);
  auto kept = sql == nullptr ? kept_.end() : kept_.find(std::string_view(sql));
  if (sql != nullptr && kept == kept_.end() && kept_.size() < kKeptStatements) {
    kept = kept_.emplace(sql, nullptr).first;
  }
  if (kept == kept_.end() || kept->second != nullptr) {
    sqlite3_finalize(statement);
    return;
  }
  sqlite3_reset(statement);
  sqlite3_clear_bindings(statement);
  kept->second = statement;
}

void StatementPool::clear() {
  for (const auto& [sql, statement] : kept_) {
    sqlite3_finalize(statement);
  }
  kept_.clear();
}

Statement::Statement(sqlite3* db, StatementPool& pool, const char* sql, std::string path)
    : db_(db), pool_(&pool), path_(std::move(path)) {
  check(pool.take(db_, sql, statement_));
}

Statement::Statement(Statement&& other) noexcept
    : db_(other.db_),
      pool_(other.pool_),
      statement_(std::exchange(other.statement_, nullptr)),
      bound_(other.bound_),
      failure_(other.failure_),
      message_(std::move(other.message_)),
      path_(std::move(other.path_)) {}

Statement::~Statement() { pool_->give_back(statement_); }

void Statement::check(int code) {
  if (code != SQLITE_OK && code != SQLITE_ROW && code != SQLITE_DONE && failure_ == SQLITE_OK) {
    failure_ = code;
    message_ = sqlite3_errmsg(db_);
  }
}

Statement& Statement::bind(std::int64_t value) {
  check(sqlite3_bind_int64(statement_, ++bound_, value));
  return *this;
}

Statement& Statement::bind(double value) {
  check(sqlite3_bind_double(statement_, ++bound_, value));
  return *this;
}

Statement& Statement::bind(std::string_view value) {
  // An empty view may have a null address, which SQLite would bind as NULL.
  const char* data = value.data() == nullptr ? "" : value.data();
  check(
      sqlite3_bind_text64(statement_, ++bound_, data, value.size(), SQLITE_TRANSIENT, SQLITE_UTF8));
  return *this;
}

Statement& Statement::bind(std::optional<double> value) {
  if (value) {
    return bind(*value);
  }
  check(sqlite3_bind_null(statement_, ++bound_));
  return *this;
}

bool Statement::step() {
  if (failure_ != SQLITE_OK) {
    return false;
  }
  const int code = sqlite3_step(statement_);
  check(code);
  return code == SQLITE_ROW;
}

Status Statement::run() {
  while (step()) {
  }
  return status();
}

Status Statement::status() const {
  if (failure_ == SQLITE_OK) {
    return core::ok_status();
  }
  return sqlite_error(failure_, message_, path_, errno_of(db_, failure_));
}

std::int64_t Statement::integer(int column) const {
  return sqlite3_column_int64(statement_, column);
}

double Statement::real(int column) const { return sqlite3_column_double(statement_, column); }

std::string Statement::text(int column) const {
  const void* data = sqlite3_column_blob(statement_, column);
  const int bytes = sqlite3_column_bytes(statement_, column);
  return data == nullptr
             ? std::string()
             : std::string(static_cast<const char*>(data), static_cast<std::size_t>(bytes));
}

std::optional<double> Statement::optional_real(int column) const {
  if (sqlite3_column_type(statement_, column) == SQLITE_NULL) {
    return std::nullopt;
  }
  return real(column);
}

Status Database::Session::execute(const char* sql) {
  const int code = sqlite3_exec(db_->handle_, sql, nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) {
    return sqlite_error(code, sqlite3_errmsg(db_->handle_), db_->path_,
                        errno_of(db_->handle_, code));
  }
  return core::ok_status();
}

std::int64_t Database::Session::last_row_id() const {
  return sqlite3_last_insert_rowid(db_->handle_);
}

std::int64_t Database::Session::total_changes() const {
  return sqlite3_total_changes64(db_->handle_);
}

std::int64_t Database::Session::changes() const { return sqlite3_changes(db_->handle_); }

core::Result<std::unique_ptr<Database>> Database::open(const std::string& path) {
  if (const Status whole = check_not_cut(path); !whole) {
    return whole.error();
  }
  auto damage = DatabaseMark(path).check();
  if (!damage) {
    return damage.error();
  }
  // SQLite would make the file readable by all users; its journals inherit the database's mode.
  if (const auto made = open_file(path, O_RDWR | O_CREAT); !made) {
    return made.error();
  } else if (::fchmod(made->get(), S_IRUSR | S_IWUSR) != 0) {
    return file_error("cannot change the mode of", path, errno);
  }
  sqlite3* handle = nullptr;
  const int flags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX;
  const int code = sqlite3_open_v2(path.c_str(), &handle, flags, nullptr);
  // NOLINTNEXTLINE: private constructor.
  std::unique_ptr<Database> database(new Database(handle, path, *std::move(damage)));
  if (code != SQLITE_OK) {
    return sqlite_error(code, handle == nullptr ? "no memory" : sqlite3_errmsg(handle), path);
  }
  sqlite3_extended_result_codes(handle, 1);
  sqlite3_busy_timeout(handle, 5000);
  const auto prepare = [&]() -> Status {
    {
      Session session = database->session();
      Status set = session.execute(
          "PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL; PRAGMA foreign_keys=ON;"
          "PRAGMA temp_store=MEMORY;");
      if (!set) {
        return set;
      }
    }
    sqlite3_wal_hook(handle, &Database::on_commit, database.get());
    return migrate(*database);
  };
  Status ready = prepare();
  if (!ready && ready.error().code == ErrorCode::kNoSpace && database->reserve_.give_up()) {
    ready = prepare();
  }
  if (!ready) {
    return ready.error();
  }
  static_cast<void>(database->reserve_.take());  // On a full disk: retried later.
  return database;
}

bool Database::make_room(Session& session) { return reserve_.give_up() || checkpoint(session); }

void Database::note_commit(int pages) {
  sqlite3_file* log = nullptr;
  DatabaseMark::LogHead head{};
  if (sqlite3_file_control(handle_, "main", SQLITE_FCNTL_JOURNAL_POINTER, &log) == SQLITE_OK &&
      log->pMethods != nullptr &&
      log->pMethods->xRead(log, head.data(), static_cast<int>(head.size()), 0) == SQLITE_OK) {
    mark_.note_commit(head, static_cast<std::uint32_t>(pages));
  }
}

int Database::on_commit(void* self, sqlite3* handle, const char* name, int pages) {
  static_cast<Database*>(self)->note_commit(pages);
  // As PRAGMA wal_autocheckpoint, whose hook this one replaces. It is tried again later.
  constexpr int kCheckpointPages = 1000;
  if (pages >= kCheckpointPages) {
    static_cast<void>(
        sqlite3_wal_checkpoint_v2(handle, name, SQLITE_CHECKPOINT_PASSIVE, nullptr, nullptr));
  }
  return SQLITE_OK;
}

Status Database::checkpoint() {
  Session session(*this);
  return checkpoint(session);
}

Status Database::checkpoint(Session& /*session*/) {
  if (!mark_.has_log()) {
    return core::ok_status();
  }
  mark_.note_unknown();
  int pages = 0;
  const int code =
      sqlite3_wal_checkpoint_v2(handle_, nullptr, SQLITE_CHECKPOINT_TRUNCATE, &pages, nullptr);
  if (pages > 0) {  // Another process reads.
    note_commit(pages);
  }
  return code == SQLITE_OK || code == SQLITE_BUSY
             ? core::ok_status()
             : Status(sqlite_error(code, sqlite3_errmsg(handle_), path_, errno_of(handle_, code)));
}

Database::~Database() {
  if (handle_ != nullptr && sqlite3_db_readonly(handle_, "main") == 0) {
    mark_.note_unknown();
  }
  statements_.clear();
  sqlite3_close_v2(handle_);
  if (!mark_.has_log()) {  // It was the last connection.
    mark_.note_closed();
  }
}

}  // namespace server
