#include "coordinator/journal/journal.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>

#include "coordinator/journal/database.hpp"
#include "coordinator/journal/journal_file.hpp"
#include "coordinator/journal/row_bytes.hpp"

namespace pvsfarm {
namespace {

constexpr int kCheckpointPages = 1000;

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

std::optional<CellKey> key_from(std::span<const std::byte> bytes) {
  const auto at = [&](std::size_t i) { return std::to_integer<std::uint8_t>(bytes[i]); };
  if (bytes.size() != 13 || at(12) > 62) return std::nullopt;
  CellKey key{0, 0};
  for (std::size_t i = 0; i < 4; ++i) key.root = key.root << 8 | at(i);
  for (std::size_t i = 4; i < 12; ++i) key.path = key.path << 8 | at(i);
  key.path >>= 63 - at(12);
  if (key.path == 0 || key.depth() != at(12)) return std::nullopt;
  return key;
}

constexpr const char* kSchema =
    "CREATE TABLE meta(name TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;"
    "CREATE TABLE results(key BLOB PRIMARY KEY, digest BLOB NOT NULL, hidden BLOB NOT NULL,"
    " seen BLOB NOT NULL, point_triangles INTEGER NOT NULL, statistics BLOB NOT NULL,"
    " hints BLOB NOT NULL);";
constexpr const char* kSetMeta = "INSERT OR REPLACE INTO meta VALUES(?,?)";

struct PendingRow {
  KeyBytes key;
  Digest digest;
  ResultRow row;
  bool replaces = false;  // a committed one
};

Status write_meta(Database& db, const Statement& set_meta, const std::string& name,
                  const std::string& value) {
  Use use(set_meta);
  use.bind(1, name);
  use.bind(2, value);
  return db.step(set_meta);
}

// An empty journal of the bake, as the bytes of its file.
Result<std::vector<std::byte>> empty_journal(const std::string& path,
                                             const JournalBinding& binding) {
  Database db;
  if (Status s = db.open_in_memory(path); !s) return s.error();
  const std::string pragmas = "PRAGMA application_id=" + std::to_string(kJournalId) +
                              ";PRAGMA user_version=" + std::to_string(kJournalFormat) + ";";
  if (Status s = db.run((pragmas + kSchema).c_str()); !s) return s.error();
  Statement set_meta;
  if (Status s = db.prepare(set_meta, kSetMeta); !s) return s.error();
  if (Status s = write_meta(db, set_meta, "bake", binding.bake.hex()); !s) return s.error();
  if (Status s = write_meta(db, set_meta, "settings", binding.settings); !s) return s.error();
  return db.image();
}

}  // namespace

struct Journal::State {
  Database db;
  Statement begin_all, commit_all, roll_back, insert, replace, find, read, select, set_meta,
      get_meta;
  std::vector<PendingRow> pending;
  std::string pending_kernel;
  std::uint64_t committed = 0;
  int checkpoint_every = kCheckpointPages, checkpoint_at = kCheckpointPages;
  bool settled = true;  // what was found is known to be on the disk
  bool written = false;
  bool full = false;
  bool failed = false;  // nothing more may be written

  ~State() { close(written && !failed); }
  void close(bool tidy) {
    for (Statement* s : {&begin_all, &commit_all, &roll_back, &insert, &replace, &find, &read,
                         &select, &set_meta, &get_meta})
      s->finalize();
    db.close(tidy);
  }

  std::uint64_t added() const {
    return static_cast<std::uint64_t>(
        std::ranges::count_if(pending, [](const PendingRow& row) { return !row.replaces; }));
  }

  Result<std::string> meta(const std::string& name) {
    Use use(get_meta);
    use.bind(1, name);
    const int code = sqlite3_step(use.handle);
    if (code == SQLITE_DONE) return std::string();
    if (code != SQLITE_ROW) return db.error();
    return std::string(reinterpret_cast<const char*>(sqlite3_column_text(use.handle, 0)));
  }

  Status prepare_all();
  Status check(const JournalBinding& binding);
  Status write(const PendingRow& waiting);
  Result<ResultRow> row(const Statement& from) const;
  Status write_pending();
  Status settle();
  Status make_durable();
  Status after(const Status& outcome);
};

Status Journal::State::prepare_all() {
  const std::string kSelect =
      "SELECT key,digest,hidden,seen,point_triangles,statistics,hints FROM results";
  const std::pair<Statement*, std::string> statements[] = {
      {&begin_all, "BEGIN IMMEDIATE"},
      {&commit_all, "COMMIT"},
      {&roll_back, "ROLLBACK"},
      {&insert, "INSERT INTO results VALUES(?,?,?,?,?,?,?)"},
      {&replace, "INSERT OR REPLACE INTO results VALUES(?,?,?,?,?,?,?)"},
      {&find, "SELECT digest FROM results WHERE key=?"},
      {&read, kSelect + " WHERE key=?"},
      {&select, kSelect + " ORDER BY key"},
      {&set_meta, kSetMeta},
      {&get_meta, "SELECT value FROM meta WHERE name=?"}};
  for (const auto& [statement, sql] : statements)
    if (Status s = db.prepare(*statement, sql.c_str()); !s) return s;
  return {};
}

Status Journal::State::check(const JournalBinding& binding) {
  const Result<std::string> bake = meta("bake");
  if (!bake) return bake.error();
  if (*bake == binding.bake.hex()) return {};
  const Result<std::string> settings = meta("settings");
  std::string text = db.path() + ": the journal of another bake";
  if (settings && *settings != binding.settings)
    text += " (its settings: " + *settings + "; asked for: " + binding.settings + ")";
  else
    text += " (another scene, cells or algorithm)";
  return invalid_input(text + "; give --fresh to discard it, or another output");
}

Journal::Journal(std::unique_ptr<State> state) : state_(std::move(state)) {}
Journal::~Journal() = default;

std::uint64_t Journal::bytes() const {
  std::uint64_t sum = 0;
  for (const char* suffix : {"", "-wal"}) {
    std::error_code none;
    const auto size = std::filesystem::file_size(state_->db.path() + suffix, none);
    if (!none) sum += size;
  }
  return sum;
}

Result<std::unique_ptr<Journal>> Journal::open(const std::string& path,
                                               const JournalBinding& binding) {
  if (!file_exists(path)) {
    Result<std::vector<std::byte>> image = empty_journal(path, binding);
    if (!image) return image.error();
    if (Status s = make_journal_file(path, *image); !s) return s.error();
  }
  if (Status s = check_journal_file(path); !s) return s.error();
  auto state = std::make_unique<State>();
  if (Status s = state->db.open(path); !s) return s.error();
  if (Status s = state->prepare_all(); !s) return s.error();
  if (Status s = state->check(binding); !s) {
    remove_empty_wal(path);  // of our own making: the file is ours as long as it is open
    return s.error();
  }
  const Result<std::int64_t> rows = state->db.number("SELECT count(*) FROM results");
  if (!rows) return rows.error();
  state->committed = static_cast<std::uint64_t>(*rows);
  state->settled = !has_wal(path);
  return std::unique_ptr<Journal>(new Journal(std::move(state)));
}

Status Journal::check_free(const std::string& path) {
  Database db;
  if (check_journal_file(path).ok())
    if (Status s = db.open(path); !s && s.error().kind == ErrorKind::kIo) return s;
  return {};
}

Status Journal::discard(const std::string& path) {
  Database db;  // until the files are gone nobody else may begin with them
  if (check_journal_file(path).ok())
    if (Status s = db.open(path); !s && s.error().kind == ErrorKind::kIo) return s;
  return remove_journal_files(path);
}

Result<std::optional<Digest>> Journal::find(const CellKey& key) {
  const KeyBytes bytes = key_bytes(key);
  for (const PendingRow& pending : state_->pending)
    if (pending.key == bytes) return std::optional<Digest>(pending.digest);
  Use use(state_->find);
  use.bind(1, std::as_bytes(std::span(bytes)));
  const int code = sqlite3_step(use.handle);
  if (code == SQLITE_DONE) return std::optional<Digest>();
  Digest digest;
  if (code != SQLITE_ROW || sqlite3_column_bytes(use.handle, 0) != 32)
    return Error{kDiskFailed,
                 code != SQLITE_ROW ? state_->db.error().text : state_->db.damaged().text};
  std::memcpy(digest.bytes.data(), sqlite3_column_blob(use.handle, 0), 32);
  return std::optional<Digest>(digest);
}

Status Journal::append(const ResultRow& row) {
  state_->pending.push_back({key_bytes(row.key), delta_digest(row), row});
  return {};
}

Status Journal::replace(const ResultRow& row) {
  PendingRow waiting{key_bytes(row.key), delta_digest(row), row, true};
  const auto same = std::ranges::find(state_->pending, waiting.key, &PendingRow::key);
  if (same == state_->pending.end()) {
    state_->pending.push_back(std::move(waiting));
  } else {
    waiting.replaces = same->replaces;
    *same = std::move(waiting);
  }
  return {};
}

Result<std::optional<ResultRow>> Journal::read(const CellKey& key) {
  const KeyBytes bytes = key_bytes(key);
  const auto same = std::ranges::find(state_->pending, bytes, &PendingRow::key);
  if (same != state_->pending.end()) return std::optional(same->row);
  Use use(state_->read);
  use.bind(1, std::as_bytes(std::span(bytes)));
  const int code = sqlite3_step(use.handle);
  if (code == SQLITE_DONE) return std::optional<ResultRow>();
  if (code != SQLITE_ROW) return Error{kDiskFailed, state_->db.error().text};
  Result<ResultRow> row = state_->row(state_->read);
  if (!row) return Error{kDiskFailed, row.error().text};
  return std::optional(std::move(row).value());
}

Status Journal::set_kernel(const std::string& kernel) {
  state_->pending_kernel = kernel;
  return {};
}

std::size_t Journal::uncommitted() const {
  return state_->pending.size() + (state_->settled ? 0 : state_->committed);
}
std::uint64_t Journal::row_count() const { return state_->committed + state_->added(); }
bool Journal::disk_full() const { return state_->full; }
void Journal::checkpoint_every(int pages) {
  state_->checkpoint_every = state_->checkpoint_at = pages;
}

Status Journal::State::write(const PendingRow& waiting) {
  const Statement& into = waiting.replaces ? replace : insert;
  Use use(into);
  const std::vector<std::byte> statistics = encode(waiting.row.statistics);
  use.bind(1, std::as_bytes(std::span(waiting.key)));
  use.bind(2, std::as_bytes(std::span(waiting.digest.bytes)));
  use.bind(3, waiting.row.hidden);
  use.bind(4, waiting.row.seen);
  sqlite3_bind_int64(use.handle, 5, static_cast<sqlite3_int64>(waiting.row.point_triangles));
  use.bind(6, statistics);
  use.bind(7, waiting.row.hints);
  return db.step(into);
}

Status Journal::State::write_pending() {
  if (Status s = db.step(begin_all); !s) return s;
  if (!pending_kernel.empty())
    if (Status s = write_meta(db, set_meta, "kernel", pending_kernel); !s) return s;
  for (const PendingRow& row : pending)
    if (Status s = write(row); !s) return s;
  return db.step(commit_all);
}

// What an earlier process wrote may be in the system's memory only, or be there although its sync
// failed; copied into the main file and synced it is on the disk.
Status Journal::State::settle() {
  if (Status s = db.checkpoint(Database::Checkpoint::kTruncate); !s) return s;
  if (Status s = sync_folder_of(db.path()); !s) return s;
  settled = true;
  return {};
}

Status Journal::State::make_durable() {
  const bool nothing = pending.empty() && pending_kernel.empty();
  if (settled && nothing) return {};
  written = true;
  if (!settled)
    if (Status s = settle(); !s) return s;
  if (nothing) return {};
  // Neighbours together: fewer pages of the index are touched.
  std::ranges::sort(pending, {}, &PendingRow::key);
  if (Status s = write_pending(); !s) return s;
  committed += added();
  pending.clear();
  pending_kernel.clear();
  return {};
}

Status Journal::State::after(const Status& outcome) {
  full = !outcome && db.disk_full();
  if (outcome) return {};
  // SQLite may have rolled back already.
  const bool rolled_back = !db.in_transaction() || db.step(roll_back);
  if (full && rolled_back) return {};
  failed = true;
  return Error{kDiskFailed, outcome.error().text +
                                "; nothing that was acknowledged is lost: mend the disk, and the "
                                "same command goes on from there"};
}

Status Journal::commit() {
  State& state = *state_;
  if (Status s = state.after(state.make_durable()); !s || state.full) return s;
  if (state.db.wal_frames() < state.checkpoint_at) return {};
  // A full disk has room for the -wal file to grow, or the next commit finds out.
  const Status copied = state.after(state.db.checkpoint(Database::Checkpoint::kReuse));
  state.checkpoint_at = state.checkpoint_every + (state.full ? state.db.wal_frames() : 0);
  state.full = false;
  return copied;
}

Result<std::string> Journal::kernel() const {
  if (!state_->pending_kernel.empty()) return state_->pending_kernel;
  return state_->meta("kernel");
}

// Of a statement that stands at a row of kSelect.
Result<ResultRow> Journal::State::row(const Statement& from) const {
  const auto blob = [&](int column) {
    const auto* first = static_cast<const std::byte*>(sqlite3_column_blob(from.handle, column));
    return std::span(first, static_cast<std::size_t>(sqlite3_column_bytes(from.handle, column)));
  };
  const auto copy = [&](int column) {
    return std::vector<std::byte>(blob(column).begin(), blob(column).end());
  };
  const auto key = key_from(blob(0));
  const auto points = static_cast<std::uint64_t>(sqlite3_column_int64(from.handle, 4));
  ResultRow row{key.value_or(CellKey{}), copy(2), copy(3), points, {}, copy(6)};
  const auto digest = blob(1);
  if (!key || digest.size() != 32 ||
      std::memcmp(delta_digest(row).bytes.data(), digest.data(), 32) != 0 ||
      !decode_statistics(blob(5), row.statistics))
    return db.damaged();
  return row;
}

Status Journal::for_each(const std::function<Status(ResultRow)>& visit) const {
  Use use(state_->select);
  for (;;) {
    const int code = sqlite3_step(use.handle);
    if (code == SQLITE_DONE) return {};
    if (code != SQLITE_ROW) return state_->db.error();
    Result<ResultRow> row = state_->row(state_->select);
    if (!row) return row.error();
    if (Status s = visit(std::move(row).value()); !s) return s;
  }
}

Status Journal::remove() {
  state_->close(false);
  return remove_journal_files(state_->db.path());
}

}  // namespace pvsfarm
