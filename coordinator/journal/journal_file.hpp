// The journal as a file: made whole or not at all, known by its first bytes, removed with what
// belongs to it. Nothing here opens a database: what is not a journal is never touched.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "common/base/result.hpp"

namespace pvsfarm {

inline constexpr std::uint32_t kJournalId = 0x5056534a;  // "PVSJ", in the header of the database
inline constexpr std::uint32_t kJournalFormat = 5;

bool file_exists(const std::string& path);

// What speaks against it, judged by its header and its size. Errors: kIo (cannot be read),
// kInvalidInput (no database, cut short, of another program or format).
// Requires: this process does not have it open; its lock would be lost.
Status check_journal_file(const std::string& path);

// Puts the file there, as the image of an empty database, with `image` marked as one that has a
// -wal file; a -wal file of an earlier journal is removed first: it would be read as this one's.
// There may be a file after all when it comes to that: then another coordinator was faster, and
// its file stays. Errors: kIo.
Status make_journal_file(const std::string& path, std::span<std::byte> image);

// The main file first: without it the others mean nothing. No file is no error. Errors: kIo.
Status remove_journal_files(const std::string& path);

// Makes names that were given or taken in the file's folder durable. Errors: kIo.
Status sync_folder_of(const std::string& path);

// True if there is a -wal file with anything in it.
bool has_wal(const std::string& path);
// An empty -wal file, as opening a journal leaves it, is removed.
void remove_empty_wal(const std::string& path);

}  // namespace pvsfarm
