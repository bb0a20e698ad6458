#include "coordinator/journal/journal.hpp"

#include <sqlite3.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "coordinator/journal/row_bytes.hpp"

namespace pvsfarm {
namespace {

constexpr int kApplicationId = 0x5056534a;  // "PVSJ"
constexpr int kFormatVersion = 3;

// SQLite compares blobs as bytes: this makes its order that of CellKey.
using KeyBytes = std::array<std::uint8_t, 13>;
KeyBytes key_bytes(const CellKey& key) {
  KeyBytes out{};
  for (int i = 0; i < 4; ++i) out[i] = static_cast<std::uint8_t>(key.root >> (24 - 8 * i));
  const std::uint64_t left = key.path << (63 - key.depth());
  for (int i = 0; i < 8; ++i) out[4 + i] = static_cast<std::uint8_t>(left >> (56 - 8 * i));
  out[12] = static_cast<std::uint8_t>(key.depth());
  return out;
}

std::optional<CellKey> key_from(const std::uint8_t* bytes, int count) {
  if (count != 13 || bytes[12] > 62) return std::nullopt;
  CellKey key{0, 0};
  for (int i = 0; i < 4; ++i) key.root = key.root << 8 | bytes[i];
  for (int i = 0; i < 8; ++i) key.path = key.path << 8 | bytes[4 + i];
  key.path >>= 63 - bytes[12];
  if (key.path == 0 || key.depth() != bytes[12]) return std::nullopt;
  return key;
}

struct Statement {
  sqlite3_stmt* handle = nullptr;
  Statement() = default;
  Statement(const Statement&) = delete;
  ~Statement() { sqlite3_finalize(handle); }
};

// A prepared statement is put back whatever happens between.
struct Use {
  sqlite3_stmt* handle;
  explicit Use(const Statement& s) : handle(s.handle) {}
  ~Use() {
    sqlite3_reset(handle);
    sqlite3_clear_bindings(handle);
  }
};

constexpr const char* kSchema =
    "CREATE TABLE meta(name TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;"
    "CREATE TABLE results(key BLOB PRIMARY KEY, digest BLOB NOT NULL, hidden BLOB NOT NULL,"
    " seen BLOB NOT NULL, point_triangles INTEGER NOT NULL, statistics BLOB NOT NULL,"
    " hints BLOB NOT NULL);";

}  // namespace

struct Journal::State {
  std::string path;
  sqlite3* db = nullptr;
  Statement begin_all, commit_all, insert, find, select, set_meta, get_meta;
  std::size_t uncommitted = 0;
  std::uint64_t rows = 0;

  void close() {
    for (Statement* s : {&begin_all, &commit_all, &insert, &find, &select, &set_meta, &get_meta}) {
      sqlite3_finalize(s->handle);
      s->handle = nullptr;
    }
    sqlite3_close(db);
    db = nullptr;
  }
  ~State() { close(); }

  Error error() const {
    const int code = sqlite3_errcode(db);
    if (code == SQLITE_NOTADB || code == SQLITE_CORRUPT)
      return invalid_input(path +
                           ": damaged, or not a journal of pvsfarm; move it away, or give "
                           "--fresh to discard it");
    if (code == SQLITE_BUSY || code == SQLITE_LOCKED)
      return io_error(path + ": in use: another pvsfarm bakes to this output");
    std::string text = path + ": " + sqlite3_errmsg(db);
    if (const int number = sqlite3_system_errno(db); number != 0)
      text += std::string(" (") + std::strerror(number) + ")";
    return io_error(std::move(text));
  }
  Status run(const char* sql) {
    if (sqlite3_exec(db, sql, nullptr, nullptr, nullptr) != SQLITE_OK) return error();
    return {};
  }
  Result<int> pragma(const char* sql) {
    Statement s;
    if (sqlite3_prepare_v2(db, sql, -1, &s.handle, nullptr) != SQLITE_OK) return error();
    if (sqlite3_step(s.handle) != SQLITE_ROW) return error();
    return sqlite3_column_int(s.handle, 0);
  }
  Status prepare(Statement& s, const char* sql) {
    if (sqlite3_prepare_v3(db, sql, -1, SQLITE_PREPARE_PERSISTENT, &s.handle, nullptr) != SQLITE_OK)
      return error();
    return {};
  }
  Status begin() {
    if (sqlite3_get_autocommit(db) == 0) return {};
    return step(begin_all);
  }
  Status step(const Statement& statement) {
    Use use(statement);
    if (sqlite3_step(use.handle) != SQLITE_DONE) return error();
    return {};
  }
  Result<std::string> meta(const char* name) const {
    Use use(get_meta);
    sqlite3_bind_text(use.handle, 1, name, -1, SQLITE_STATIC);
    const int code = sqlite3_step(use.handle);
    if (code == SQLITE_DONE) return std::string();
    if (code != SQLITE_ROW) return error();
    return std::string(reinterpret_cast<const char*>(sqlite3_column_text(use.handle, 0)));
  }
  Status write_meta(const char* name, const std::string& value) {
    Use use(set_meta);
    sqlite3_bind_text(use.handle, 1, name, -1, SQLITE_STATIC);
    sqlite3_bind_text(use.handle, 2, value.c_str(), -1, SQLITE_STATIC);
    if (sqlite3_step(use.handle) != SQLITE_DONE) return error();
    return {};
  }

  Status open();
  Status make(const JournalBinding& binding);
  Status check(const JournalBinding& binding);
};

// Nothing is written before the file is known to be a journal, or new.
Status Journal::State::open() {
  if (sqlite3_open_v2(path.c_str(), &db, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, nullptr) !=
      SQLITE_OK)
    return error();
  sqlite3_busy_timeout(db, 0);
  if (Status s = run("PRAGMA locking_mode=EXCLUSIVE"); !s) return s;
  const Result<int> id = pragma("PRAGMA application_id");
  if (!id) return id.error();
  const Result<int> tables = pragma("SELECT count(*) FROM sqlite_master");
  if (!tables) return tables.error();
  if (*tables != 0 && *id != kApplicationId)
    return invalid_input(path +
                         ": a database of another program; move it away, or give --fresh to "
                         "discard it");
  if (Status s = run("PRAGMA journal_mode=WAL"); !s) return s;
  if (Status s = run("PRAGMA synchronous=FULL"); !s) return s;
  return run("BEGIN EXCLUSIVE; COMMIT");  // taken now, held until close
}

Status Journal::State::make(const JournalBinding& binding) {
  const std::string pragmas = "PRAGMA application_id=" + std::to_string(kApplicationId) +
                              ";PRAGMA user_version=" + std::to_string(kFormatVersion) + ";";
  if (Status s = run(("BEGIN;" + pragmas + kSchema).c_str()); !s) return s;
  if (Status s = prepare(set_meta, "INSERT OR REPLACE INTO meta VALUES(?,?)"); !s) return s;
  if (Status s = write_meta("bake", binding.bake.hex()); !s) return s;
  if (Status s = write_meta("settings", binding.settings); !s) return s;
  return run("COMMIT");
}

Status Journal::State::check(const JournalBinding& binding) {
  const Result<int> version = pragma("PRAGMA user_version");
  if (!version) return version.error();
  if (*version != kFormatVersion)
    return invalid_input(path + ": a journal of format " + std::to_string(*version) +
                         ", this program writes " + std::to_string(kFormatVersion) +
                         "; finish the bake with the program that began it, or give --fresh");
  if (Status s = prepare(get_meta, "SELECT value FROM meta WHERE name=?"); !s) return s;
  const Result<std::string> bake = meta("bake");
  if (!bake) return bake.error();
  if (*bake == binding.bake.hex()) return {};
  const Result<std::string> settings = meta("settings");
  std::string text = path + ": the journal of another bake";
  if (settings && *settings != binding.settings)
    text += " (its settings: " + *settings + "; asked for: " + binding.settings + ")";
  else
    text += " (another scene, cells or algorithm)";
  return invalid_input(text + "; give --fresh to discard it, or another output");
}

Journal::Journal(std::unique_ptr<State> state) : state_(std::move(state)) {}
Journal::~Journal() = default;

Result<std::unique_ptr<Journal>> Journal::open(const std::string& path,
                                               const JournalBinding& binding) {
  auto state = std::make_unique<State>();
  state->path = path;
  if (Status s = state->open(); !s) return s.error();
  const Result<int> tables = state->pragma("SELECT count(*) FROM sqlite_master");
  if (!tables) return tables.error();
  const Status bound = *tables == 0 ? state->make(binding) : state->check(binding);
  if (!bound) return bound.error();
  const std::pair<Statement*, const char*> statements[] = {
      {&state->begin_all, "BEGIN IMMEDIATE"},
      {&state->commit_all, "COMMIT"},
      {&state->insert, "INSERT INTO results VALUES(?,?,?,?,?,?,?)"},
      {&state->find, "SELECT digest FROM results WHERE key=?"},
      {&state->select,
       "SELECT key,digest,hidden,seen,point_triangles,statistics,hints FROM results ORDER BY key"},
      {&state->set_meta, "INSERT OR REPLACE INTO meta VALUES(?,?)"},
      {&state->get_meta, "SELECT value FROM meta WHERE name=?"}};
  for (const auto& [statement, sql] : statements) {
    if (statement->handle != nullptr) continue;
    if (Status s = state->prepare(*statement, sql); !s) return s.error();
  }
  const Result<int> rows = state->pragma("SELECT count(*) FROM results");
  if (!rows) return rows.error();
  state->rows = static_cast<std::uint64_t>(*rows);
  return std::unique_ptr<Journal>(new Journal(std::move(state)));
}

Status Journal::discard(const std::string& path) {
  for (const char* suffix : {"", "-wal", "-shm"})
    if (unlink((path + suffix).c_str()) != 0 && errno != ENOENT)
      return io_error(path + suffix + ": cannot remove: " + std::strerror(errno));
  return {};
}

Result<std::optional<Digest>> Journal::find(const CellKey& key) {
  Use use(state_->find);
  const KeyBytes bytes = key_bytes(key);
  sqlite3_bind_blob(use.handle, 1, bytes.data(), bytes.size(), SQLITE_STATIC);
  const int code = sqlite3_step(use.handle);
  if (code == SQLITE_DONE) return std::optional<Digest>();
  if (code != SQLITE_ROW) return state_->error();
  Digest digest;
  if (sqlite3_column_bytes(use.handle, 0) != 32)
    return invalid_input(state_->path + ": damaged row; give --fresh to discard the journal");
  std::memcpy(digest.bytes.data(), sqlite3_column_blob(use.handle, 0), 32);
  return std::optional<Digest>(digest);
}

Status Journal::append(const ResultRow& row) {
  if (Status s = state_->begin(); !s) return s;
  Use use(state_->insert);
  const KeyBytes key = key_bytes(row.key);
  const Digest digest = delta_digest(row);
  const std::vector<std::byte> statistics = encode(row.statistics);
  const auto bind = [&](int column, std::span<const std::byte> blob) {
    // SQLite takes a null pointer for NULL, not for an empty blob.
    const void* first = blob.empty() ? "" : static_cast<const void*>(blob.data());
    sqlite3_bind_blob64(use.handle, column, first, blob.size(), SQLITE_STATIC);
  };
  bind(1, std::as_bytes(std::span(key)));
  bind(2, std::as_bytes(std::span(digest.bytes)));
  bind(3, row.hidden);
  bind(4, row.seen);
  sqlite3_bind_int64(use.handle, 5, static_cast<sqlite3_int64>(row.point_triangles));
  bind(6, statistics);
  bind(7, row.hints);
  if (sqlite3_step(use.handle) != SQLITE_DONE) return state_->error();
  ++state_->uncommitted;
  ++state_->rows;
  return {};
}

std::size_t Journal::uncommitted() const { return state_->uncommitted; }
std::uint64_t Journal::row_count() const { return state_->rows; }

Status Journal::commit() {
  if (sqlite3_get_autocommit(state_->db) != 0) return {};
  if (Status s = state_->step(state_->commit_all); !s) return s;
  state_->uncommitted = 0;
  return {};
}

Result<std::string> Journal::kernel() const { return state_->meta("kernel"); }

Status Journal::set_kernel(const std::string& kernel) {
  if (Status s = state_->begin(); !s) return s;
  if (Status s = state_->write_meta("kernel", kernel); !s) return s;
  return commit();
}

Status Journal::for_each(const std::function<Status(ResultRow)>& visit) const {
  Use use(state_->select);
  for (;;) {
    const int code = sqlite3_step(use.handle);
    if (code == SQLITE_DONE) return {};
    if (code != SQLITE_ROW) return state_->error();
    const auto blob = [&](int column) {
      const auto* first = static_cast<const std::byte*>(sqlite3_column_blob(use.handle, column));
      return std::span(first, static_cast<std::size_t>(sqlite3_column_bytes(use.handle, column)));
    };
    const auto copy = [&](int column) {
      return std::vector<std::byte>(blob(column).begin(), blob(column).end());
    };
    const auto key = key_from(reinterpret_cast<const std::uint8_t*>(blob(0).data()),
                              sqlite3_column_bytes(use.handle, 0));
    const auto points = static_cast<std::uint64_t>(sqlite3_column_int64(use.handle, 4));
    ResultRow row{key.value_or(CellKey{}), copy(2), copy(3), points, {}, copy(6)};
    const auto digest = blob(1);
    if (!key || digest.size() != 32 ||
        std::memcmp(delta_digest(row).bytes.data(), digest.data(), 32) != 0 ||
        !decode_statistics(blob(5), row.statistics))
      return invalid_input(state_->path + ": damaged row; give --fresh to discard the journal");
    if (Status s = visit(std::move(row)); !s) return s;
  }
}

Status Journal::remove() {
  state_->close();
  return discard(state_->path);
}

}  // namespace pvsfarm
