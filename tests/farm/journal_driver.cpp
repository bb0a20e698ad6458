// A small program that fills a journal and makes a file of it, for tests that kill it at every
// call:
//   journal_driver FILE ROWS ROWS_A_COMMIT CHECKPOINT_PAGES
// Prints "has N" for each row that it finds, "ack N" for each that a commit made durable, "done"
// when the file is complete. Started again it goes on. Ends as `pvsfarm` does.
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <set>
#include <string>

#include "common/base/file.hpp"
#include "common/base/random.hpp"
#include "coordinator/journal/journal.hpp"

namespace pvsfarm {
namespace {

struct Plan {
  std::string file;
  std::uint32_t rows = 0, rows_a_commit = 0;
  int checkpoint_pages = 0;
  std::string journal() const { return file + ".journal"; }
};

// At once, for whoever reads it after our death.
void say(const std::string& line) {
  const std::string text = line + "\n";
  if (::write(STDOUT_FILENO, text.data(), text.size()) < 0) std::abort();
}

// From a byte to two pages, so that some of it overflows.
ResultRow row_of(std::uint32_t number) {
  Random random(number + 1);
  const auto some = [&](std::uint64_t limit) {
    std::vector<std::byte> bytes(1 + random.below(limit));
    for (std::byte& b : bytes) b = static_cast<std::byte>(random.next());
    return bytes;
  };
  ResultRow row{.key = {number, 1}, .hidden = some(number % 7 == 0 ? 8000 : 300), .seen = some(60)};
  row.point_triangles = number;
  row.statistics.planes = number;
  return row;
}

Status fill(const Plan& plan, Journal& journal) {
  std::set<std::uint32_t> found;
  const Status read = journal.for_each([&](const ResultRow& row) {
    PVS_CHECK(delta_digest(row) == delta_digest(row_of(row.key.root)));
    PVS_CHECK_EQ(row.statistics.planes, row.key.root);
    found.insert(row.key.root);
    return Status();
  });
  if (!read) return read;
  if (Status s = journal.commit(); !s) return s;
  for (const std::uint32_t row : found) say("has " + std::to_string(row));
  std::vector<std::uint32_t> waiting;
  for (std::uint32_t i = 0; i < plan.rows; ++i) {
    const std::uint32_t number = i * 37 % plan.rows;  // in no order
    if (found.count(number) == 0) {
      if (Status s = journal.append(row_of(number)); !s) return s;
      waiting.push_back(number);
    }
    if (waiting.size() < plan.rows_a_commit && i + 1 < plan.rows) continue;
    if (Status s = journal.commit(); !s) return s;
    for (const std::uint32_t row : waiting) say("ack " + std::to_string(row));
    waiting.clear();
  }
  return {};
}

Status run(const Plan& plan) {
  if (access(plan.file.c_str(), F_OK) == 0 && access(plan.journal().c_str(), F_OK) != 0) {
    say("done");
    return {};
  }
  auto journal = Journal::open(plan.journal(), {digest_of({}), "driver"});
  if (!journal) return journal.error();
  (*journal)->checkpoint_every(plan.checkpoint_pages);
  if (Status s = fill(plan, **journal); !s) return s;
  std::string text;
  const Status read = (*journal)->for_each([&](const ResultRow& row) {
    text += std::to_string(row.key.root) + " " + delta_digest(row).hex() + "\n";
    return Status();
  });
  if (!read) return read;
  if (Status s = write_file(plan.file, text); !s) return s;
  if (Status s = (*journal)->remove(); !s) return s;
  say("done");
  return {};
}

}  // namespace
}  // namespace pvsfarm

int main(int argc, char** argv) {
  using namespace pvsfarm;
  PVS_CHECK_EQ(argc, 5);
  const auto number = [&](int i) { return static_cast<std::uint32_t>(std::atoi(argv[i])); };
  const Status status = run({argv[1], number(2), number(3), static_cast<int>(number(4))});
  if (status) return 0;
  std::fprintf(stderr, "%s\n", status.error().text.c_str());
  return static_cast<int>(status.error().kind);
}
