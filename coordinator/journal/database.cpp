#include "coordinator/journal/database.hpp"

#include <cerrno>
#include <cstring>
#include <memory>

namespace pvsfarm {

void Use::bind(int column, std::span<const std::byte> blob) const {
  // SQLite takes a null pointer for NULL, not for an empty blob.
  const void* first = blob.empty() ? "" : static_cast<const void*>(blob.data());
  sqlite3_bind_blob64(handle, column, first, blob.size(), SQLITE_STATIC);
}

void Use::bind(int column, const std::string& text) const {
  sqlite3_bind_text64(handle, column, text.data(), text.size(), SQLITE_STATIC, SQLITE_UTF8);
}

// SQLite's own checkpoints, after a commit and when a file is closed, swallow their errors: an
// fsync that failed would be forgotten, and what it should have kept overwritten. So both are off.
Status Database::open(const std::string& path) {
  path_ = path;
  const int flags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOMUTEX;
  if (sqlite3_open_v2(path.c_str(), &handle_, flags, nullptr) != SQLITE_OK) return error();
  sqlite3_extended_result_codes(handle_, 1);
  sqlite3_busy_timeout(handle_, 0);
  sqlite3_db_config(handle_, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
  const auto after_commit = [](void* frames, sqlite3*, const char*, int count) {
    *static_cast<int*>(frames) = count;
    return SQLITE_OK;
  };
  sqlite3_wal_hook(handle_, after_commit, &wal_frames_);
  // In this order: with the lock held from the first read on, no -shm file is needed.
  if (Status s = run("PRAGMA locking_mode=EXCLUSIVE"); !s) return s;
  return run("PRAGMA synchronous=FULL; BEGIN EXCLUSIVE; COMMIT");
}

Status Database::open_in_memory(const std::string& path) {
  path_ = path;
  if (sqlite3_open(":memory:", &handle_) != SQLITE_OK) return error();
  return {};
}

Result<std::vector<std::byte>> Database::image() {
  sqlite3_int64 size = 0;
  const std::unique_ptr<unsigned char, void (*)(void*)> bytes(
      sqlite3_serialize(handle_, "main", &size, 0), sqlite3_free);
  if (bytes == nullptr) return runtime_error(path_ + ": not enough memory");
  const auto* first = reinterpret_cast<const std::byte*>(bytes.get());
  return std::vector<std::byte>(first, first + size);
}

void Database::close(bool tidy) {
  if (tidy && handle_ != nullptr)
    sqlite3_db_config(handle_, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 0, nullptr);
  sqlite3_close(handle_);
  handle_ = nullptr;
}

Status Database::run(const char* sql) {
  if (sqlite3_exec(handle_, sql, nullptr, nullptr, nullptr) != SQLITE_OK) return error();
  return {};
}

Result<std::int64_t> Database::number(const char* sql) {
  Statement statement;
  if (Status s = prepare(statement, sql); !s) return s.error();
  if (sqlite3_step(statement.handle) != SQLITE_ROW) return error();
  return sqlite3_column_int64(statement.handle, 0);
}

Status Database::prepare(Statement& statement, const char* sql) {
  if (sqlite3_prepare_v3(handle_, sql, -1, SQLITE_PREPARE_PERSISTENT, &statement.handle, nullptr) !=
      SQLITE_OK)
    return error();
  return {};
}

Status Database::step(const Statement& statement) {
  const int code = sqlite3_step(statement.handle);
  if (code == SQLITE_DONE) {
    sqlite3_reset(statement.handle);
    return {};
  }
  const Error failure = error();  // before the reset can change it
  sqlite3_reset(statement.handle);
  return failure;
}

Status Database::checkpoint(Checkpoint mode) {
  const int how =
      mode == Checkpoint::kTruncate ? SQLITE_CHECKPOINT_TRUNCATE : SQLITE_CHECKPOINT_RESTART;
  if (sqlite3_wal_checkpoint_v2(handle_, nullptr, how, nullptr, nullptr) != SQLITE_OK)
    return error();
  wal_frames_ = 0;
  return {};
}

Error Database::damaged() const {
  return invalid_input(path_ +
                       ": damaged, or not a journal of pvsfarm; move it away, or give --fresh to "
                       "discard it");
}

Error Database::error() {
  const int extended = sqlite3_extended_errcode(handle_), code = extended & 0xff;
  // SQLite knows ENOSPC only. A sync that fails for want of space has lost what it was to keep.
  disk_full_ = code == SQLITE_FULL ||
               (extended == SQLITE_IOERR_WRITE && sqlite3_system_errno(handle_) == EDQUOT);
  // SQLITE_ERROR: a table is missing.
  if (code == SQLITE_NOTADB || code == SQLITE_CORRUPT || code == SQLITE_ERROR) return damaged();
  if (code == SQLITE_BUSY || code == SQLITE_LOCKED)
    return io_error(path_ + ": in use: another pvsfarm bakes to this output");
  std::string text = path_ + ": " + sqlite3_errmsg(handle_);
  if (const int number = sqlite3_system_errno(handle_); number != 0)
    text += std::string(" (") + std::strerror(number) + ")";
  return io_error(std::move(text));
}

}  // namespace pvsfarm
