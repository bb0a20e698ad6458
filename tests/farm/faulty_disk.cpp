// A disk that fails, for LD_PRELOAD: stands between a program and the system's file calls, and at
// the call it is told to, kills the program, lets the call fail, or cuts the power.
//
//   PVSFARM_DISK_FOLDER  only files whose path begins so
//   PVSFARM_DISK_FAULT   OP:PATH:N:ACTION, at the N-th call (from 1) of kind OP (write, sync, fold,
//                        rename, unlink, cut, any) on a file whose path contains PATH. 0: never
//   PVSFARM_DISK_SEED    of what a power cut leaves
//   PVSFARM_DISK_KEPT    a folder: what a program killed "before" had synced of each file is left
//                        there, and whoever comes next takes only that for synced
// ACTION: before, after (kill -9), half (half of the write, then kill -9), fail (EIO), fail-full
// (ENOSPC, of a write), power, fail-and-power (EIO; when the program has ended, the power goes,
// too).
//
// At the fault "fault T" is written to standard output (T: ms of the system's monotonic clock), at
// an orderly end "calls N", the calls that fitted. Children of the program are not touched.
//
// A power cut leaves, of every file, what was synced, and of each later write any of its sectors
// (what a sync that failed was to keep counts as never synced, whatever a later one says);
// and of the names given and taken since the folder was synced the first few, for file systems
// keep their order.
#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

namespace {

constexpr std::size_t kSectorBytes = 512;

struct Change {
  std::size_t offset = 0;
  std::string bytes;
  bool cut = false;       // to `offset` bytes
  bool doubtful = false;  // its sync failed
};
struct File {
  std::string path;  // when it was opened
  std::string synced;
  std::vector<Change> since;
  bool folder = false;
};
using FilePtr = std::shared_ptr<File>;
using Names = std::map<std::string, FilePtr>;
struct NameChange {
  std::string taken, given;  // "" for none
  FilePtr file;
};

struct Disk {
  std::mutex mutex;
  std::string folder, op, path, action, kept;
  long due = 0, calls = 0;
  std::uint64_t random = 1;
  std::map<int, FilePtr> open;
  Names names, synced_names;
  std::vector<NameChange> names_since;

  Disk() {
    unsetenv("LD_PRELOAD");
    const char* where = getenv("PVSFARM_DISK_FOLDER");
    const char* fault = getenv("PVSFARM_DISK_FAULT");
    const char* seed = getenv("PVSFARM_DISK_SEED");
    if (where == nullptr || fault == nullptr) return;
    folder = where;
    std::string parts[4], rest = fault;
    for (std::string& part : parts) {
      part = rest.substr(0, rest.find(':'));
      rest.erase(0, std::min(rest.size(), part.size() + 1));
    }
    op = parts[0];
    path = parts[1];
    due = std::stol(parts[2]);
    action = parts[3];
    if (const char* images = getenv("PVSFARM_DISK_KEPT")) kept = images;
    if (seed != nullptr) random = std::strtoull(seed, nullptr, 10) * 2 + 1;
  }
  static void say(const std::string& line) {
    syscall(SYS_write, 1, (line + "\n").data(), line.size() + 1);
  }
  bool below(const char* name) const {
    return !folder.empty() && std::strncmp(name, folder.c_str(), folder.size()) == 0;
  }
  std::uint64_t below_number(std::uint64_t limit) {  // xorshift64*
    random ^= random >> 12;
    random ^= random << 25;
    random ^= random >> 27;
    return (random * 0x2545f4914f6cdd1dull >> 33) % limit;
  }

  FilePtr file_at(int fd) {
    const auto found = open.find(fd);
    return found == open.end() ? nullptr : found->second;
  }
  // True: this is the call. "before" does not return.
  bool is_due(const char* kind, const std::string& name) {
    if ((op != kind && op != "any") || name.find(path) == std::string::npos) return false;
    if (++calls != due) return false;
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    say("fault " + std::to_string(now.tv_sec * 1000 + now.tv_nsec / 1'000'000));
    if (action == "power") cut_power();
    if (action == "before") leave_images();
    if (action == "before" || action == "power") die();
    return true;
  }
  [[noreturn]] static void die() {
    for (;;) kill(getpid(), SIGKILL);
  }
  bool fails(bool is_it) const { return is_it && action.rfind("fail", 0) == 0; }
  void after(bool is_it) const {
    if (is_it && !fails(is_it)) die();
  }

  static void apply(std::string& bytes, const Change& change) {
    if (change.cut) {
      bytes.resize(change.offset);
      return;
    }
    const std::size_t end = change.offset + change.bytes.size();
    if (bytes.size() < end) bytes.resize(end);
    std::copy(change.bytes.begin(), change.bytes.end(),
              bytes.begin() + static_cast<std::ptrdiff_t>(change.offset));
  }
  std::string what_is_left(const File& file) {
    std::string bytes = file.synced;
    const std::uint64_t kept_of_8 = below_number(9);
    for (const Change& change : file.since) {
      if (change.cut && below_number(8) < kept_of_8) apply(bytes, change);
      for (std::size_t at = 0; !change.cut && at < change.bytes.size();) {
        const std::size_t n =
            std::min(kSectorBytes - (change.offset + at) % kSectorBytes, change.bytes.size() - at);
        if (below_number(8) < kept_of_8)
          apply(bytes, {change.offset + at, change.bytes.substr(at, n)});
        at += n;
      }
    }
    return bytes;
  }
  static void rename_in(Names& among, const NameChange& change) {
    if (!change.taken.empty()) among.erase(change.taken);
    if (!change.given.empty()) among[change.given] = change.file;
  }
  static bool write_whole(const std::string& name, const std::string& bytes) {
    const int fd = static_cast<int>(
        syscall(SYS_openat, AT_FDCWD, name.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600));
    const bool whole =
        syscall(SYS_write, fd, bytes.data(), bytes.size()) == static_cast<long>(bytes.size());
    syscall(SYS_close, fd);
    return whole;
  }
  static std::string read_whole(const char* name) {
    struct stat info {};
    if (::stat(name, &info) != 0) return "";
    std::string bytes(static_cast<std::size_t>(info.st_size), '\0');
    const int fd = static_cast<int>(syscall(SYS_openat, AT_FDCWD, name, O_RDONLY, 0));
    if (syscall(SYS_pread64, fd, bytes.data(), bytes.size(), 0) != static_cast<long>(bytes.size()))
      say("cannot read");
    syscall(SYS_close, fd);
    return bytes;
  }
  std::string image_of(const std::string& name) const {
    return kept + name.substr(name.rfind('/'));
  }
  void leave_images() const {
    if (kept.empty()) return;
    for (const auto& [name, file] : names)
      if (file && !file->folder && !write_whole(image_of(name), file->synced))
        say("the disk of the test is full");
  }
  void cut_power() {
    const std::uint64_t left = below_number(names_since.size() + 1);
    for (std::size_t i = 0; i < left; ++i) rename_in(synced_names, names_since[i]);
    for (const auto& [name, file] : names) syscall(SYS_unlink, name.c_str());
    for (const auto& [name, file] : synced_names) {
      if (!write_whole(name, what_is_left(*file))) say("the disk of the test is full");
    }
  }

  void change_name(NameChange change) {
    rename_in(names, change);
    names_since.push_back(std::move(change));
  }
  // The file of a name that is open now: known before, found there, or new.
  FilePtr known(const char* name, bool existed) {
    FilePtr& file = names[name];
    if (file) return file;
    file = std::make_shared<File>(File{.path = name, .synced = {}, .since = {}});
    struct stat info {};
    if (::stat(name, &info) == 0) file->folder = S_ISDIR(info.st_mode);
    if (file->folder) return file;
    if (!existed) {
      names_since.push_back({"", name, file});
      return file;
    }
    file->synced = read_whole(name);
    synced_names[name] = file;
    const std::string image = image_of(name);
    if (kept.empty() || ::access(image.c_str(), F_OK) != 0) return file;
    // Sectors that are as they were synced stay so, whatever becomes of the rest.
    const std::string now = std::exchange(file->synced, read_whole(image.c_str()));
    if (now.size() < file->synced.size())
      file->since.push_back({.offset = now.size(), .bytes = {}, .cut = true});
    file->since.push_back({.bytes = now});
    return file;
  }
  void synced(File& file) {
    if (file.folder) {
      for (const NameChange& change : names_since) rename_in(synced_names, change);
      names_since.clear();
    }
    for (const Change& change : file.since)
      if (!change.doubtful) apply(file.synced, change);
    std::erase_if(file.since, [](const Change& change) { return !change.doubtful; });
  }
};

// Never destroyed: files are closed to the very end.
Disk& disk() {
  static Disk& the_disk = *new Disk;
  return the_disk;
}

__attribute__((destructor)) void say_calls() {
  Disk& d = disk();
  if (d.folder.empty()) return;
  Disk::say("calls " + std::to_string(d.calls));
  if (d.action == "fail-and-power" && d.calls >= d.due) d.cut_power();
}

int open_at(const char* name, int flags, mode_t mode) {
  Disk& d = disk();
  if (!d.below(name)) return static_cast<int>(syscall(SYS_openat, AT_FDCWD, name, flags, mode));
  const std::lock_guard lock(d.mutex);
  const bool existed = ::access(name, F_OK) == 0;
  const int fd = static_cast<int>(syscall(SYS_openat, AT_FDCWD, name, flags, mode));
  if (fd < 0) return fd;
  d.open[fd] = d.known(name, existed);
  if ((flags & O_TRUNC) != 0) d.open[fd]->since.push_back({.offset = 0, .bytes = {}, .cut = true});
  return fd;
}

ssize_t write_at(int fd, const void* data, size_t size, off_t offset) {
  const auto raw = [&](size_t count) {
    return offset < 0 ? syscall(SYS_write, fd, data, count)
                      : syscall(SYS_pwrite64, fd, data, count, offset);
  };
  Disk& d = disk();
  const std::lock_guard lock(d.mutex);
  const FilePtr file = d.file_at(fd);
  if (!file) return raw(size);
  const bool due = d.is_due("write", file->path);
  if (d.fails(due)) return errno = d.action == "fail-full" ? ENOSPC : EIO, -1;
  const off_t at = offset < 0 ? lseek(fd, 0, SEEK_CUR) : offset;
  const ssize_t written = raw(due && d.action == "half" ? size / 2 : size);
  if (written > 0)
    file->since.push_back(
        {static_cast<std::size_t>(at),
         std::string(static_cast<const char*>(data), static_cast<std::size_t>(written))});
  d.after(due);
  return written;
}

int sync_of(int fd, long call) {
  Disk& d = disk();
  const std::lock_guard lock(d.mutex);
  const FilePtr file = d.file_at(fd);
  if (!file) return static_cast<int>(syscall(call, fd));
  const bool due = d.is_due(file->folder ? "fold" : "sync", file->path);
  if (d.fails(due)) {
    for (Change& change : file->since) change.doubtful = true;
    return errno = EIO, -1;
  }
  const int result = static_cast<int>(syscall(call, fd));
  if (result == 0) d.synced(*file);
  d.after(due);
  return result;
}

int cut_of(int fd, off_t size) {
  Disk& d = disk();
  const std::lock_guard lock(d.mutex);
  const FilePtr file = d.file_at(fd);
  if (!file) return static_cast<int>(syscall(SYS_ftruncate, fd, size));
  const bool due = d.is_due("cut", file->path);
  if (d.fails(due)) return errno = EIO, -1;
  const int result = static_cast<int>(syscall(SYS_ftruncate, fd, size));
  file->since.push_back({static_cast<std::size_t>(size), {}, true});
  d.after(due);
  return result;
}

}  // namespace

extern "C" {

int open(const char* name, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(rest, mode_t) : 0;
  va_end(rest);
  return open_at(name, flags, mode);
}
int open64(const char* name, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(rest, mode_t) : 0;
  va_end(rest);
  return open_at(name, flags, mode);
}
int close(int fd) {
  Disk& d = disk();
  const std::lock_guard lock(d.mutex);
  d.open.erase(fd);
  return static_cast<int>(syscall(SYS_close, fd));
}
ssize_t write(int fd, const void* data, size_t size) { return write_at(fd, data, size, -1); }
ssize_t pwrite(int fd, const void* data, size_t size, off_t offset) {
  return write_at(fd, data, size, offset);
}
ssize_t pwrite64(int fd, const void* data, size_t size, off64_t offset) {
  return write_at(fd, data, size, offset);
}
int fsync(int fd) { return sync_of(fd, SYS_fsync); }
int fdatasync(int fd) { return sync_of(fd, SYS_fdatasync); }
int ftruncate(int fd, off_t size) noexcept { return cut_of(fd, size); }
int ftruncate64(int fd, off64_t size) noexcept { return cut_of(fd, size); }

int rename(const char* from, const char* to) noexcept {
  Disk& d = disk();
  if (!d.below(from)) return static_cast<int>(syscall(SYS_rename, from, to));
  const std::lock_guard lock(d.mutex);
  const bool due = d.is_due("rename", to);
  if (d.fails(due)) return errno = EIO, -1;
  const FilePtr file = d.known(from, true);
  const int result = static_cast<int>(syscall(SYS_rename, from, to));
  if (result == 0) d.change_name({from, to, file});
  d.after(due);
  return result;
}
int unlink(const char* name) noexcept {
  Disk& d = disk();
  if (!d.below(name)) return static_cast<int>(syscall(SYS_unlink, name));
  const std::lock_guard lock(d.mutex);
  const bool existed = ::access(name, F_OK) == 0;
  const bool due = existed && d.is_due("unlink", name);
  if (d.fails(due)) return errno = EIO, -1;
  if (existed) d.known(name, true);
  const int result = static_cast<int>(syscall(SYS_unlink, name));
  if (result == 0) d.change_name({name, "", nullptr});
  d.after(due);
  return result;
}

}  // extern "C"
