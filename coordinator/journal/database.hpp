// SQLite, as far as the journal needs it: one connection that holds its file alone, prepared
// statements, and errors that say what is to be done.
// Threads: one.
#pragma once

#include <sqlite3.h>

#include <span>
#include <string>
#include <vector>

#include "common/base/result.hpp"

namespace pvsfarm {

class Statement {
 public:
  Statement() = default;
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;
  ~Statement() { finalize(); }
  void finalize() {
    sqlite3_finalize(handle);
    handle = nullptr;
  }
  sqlite3_stmt* handle = nullptr;
};

// A prepared statement is put back whatever happens between.
class Use {
 public:
  explicit Use(const Statement& statement) : handle(statement.handle) {}
  Use(const Use&) = delete;
  Use& operator=(const Use&) = delete;
  ~Use() {
    sqlite3_reset(handle);
    sqlite3_clear_bindings(handle);
  }
  // The bytes outlive the use.
  void bind(int column, std::span<const std::byte> blob) const;
  void bind(int column, const std::string& text) const;

  sqlite3_stmt* const handle;
};

class Database {
 public:
  Database() = default;
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;
  ~Database() { sqlite3_close(handle_); }

  // Takes the file for itself and writes nothing to it. Errors: kIo (rights; another process has
  // it), kInvalidInput (damaged).
  Status open(const std::string& path);
  // A new one, in memory; `path` is for errors. Its image is that of a file.
  Status open_in_memory(const std::string& path);
  Result<std::vector<std::byte>> image();
  // Requires: every statement is finalized. `tidy`: what is in the -wal file goes into the main
  // one.
  void close(bool tidy);

  Status run(const char* sql);
  Result<std::int64_t> number(const char* sql);  // the only value of the only row
  Status prepare(Statement& statement, const char* sql);
  Status step(const Statement& statement);  // one that yields no rows

  // Everything committed goes into the main file, on the disk; the -wal file is begun anew, and cut
  // to nothing if `truncate`.
  enum class Checkpoint { kReuse, kTruncate };
  Status checkpoint(Checkpoint mode);

  bool in_transaction() const { return sqlite3_get_autocommit(handle_) == 0; }
  int wal_frames() const { return wal_frames_; }  // pages in the -wal file
  Error error();                                  // of the last call
  Error damaged() const;                          // what the file holds is no journal
  // The last error() was one for want of space: the same may succeed later.
  bool disk_full() const { return disk_full_; }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
  sqlite3* handle_ = nullptr;
  int wal_frames_ = 0;
  bool disk_full_ = false;
};

}  // namespace pvsfarm
