#include "store/watched_disk.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <climits>
#include <cstdarg>
#include <cstdio>

namespace bki_mapping {
namespace {

struct Watch {
  std::string folder;  ///< with a slash at the end
  WatchedDisk::Watcher watcher;
};
Watch* watch = nullptr;

bool isWatched(const std::string& path) {
  return watch && (path + "/").compare(0, watch->folder.size(), watch->folder) == 0;
}

std::string pathOf(int file) {
  char path[PATH_MAX];
  const ssize_t size = readlink(("/proc/self/fd/" + std::to_string(file)).c_str(), path, sizeof path);
  return size < 0 ? "" : std::string(path, static_cast<std::size_t>(size));
}

/// @return whether the call may happen; sets errno if not.
bool mayHappen(const DiskCall& call) {
  const int reason = watch->watcher(call);
  if (reason != 0) errno = reason;
  return reason == 0;
}

/// The C library's function of this name.
template <typename Function>
Function* real(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

using Kind = DiskCall::Kind;

template <typename Write>
ssize_t watchedWrite(int file, const void* bytes, std::size_t size, off_t position, Write&& write) {
  if (watch) {
    const std::string path = pathOf(file);
    if (isWatched(path) &&
        !mayHappen({Kind::kWrite, path, "", position, std::string(static_cast<const char*>(bytes), size)})) {
      return -1;
    }
  }
  return write();
}

int watchedOpen(const char* name, const char* path, int flags, mode_t mode) {
  if (isWatched(path) && (flags & O_CREAT) != 0 && access(path, F_OK) != 0 &&
      !mayHappen({Kind::kCreate, path, "", 0, ""})) {
    return -1;
  }
  return real<int(const char*, int, ...)>(name)(path, flags, mode);
}

int watchedSync(const char* name, int file) {
  if (watch) {
    const std::string path = pathOf(file);
    struct stat status {};
    fstat(file, &status);
    const Kind kind = S_ISDIR(status.st_mode) ? Kind::kSyncFolder : Kind::kSync;
    if (isWatched(path) && !mayHappen({kind, path, "", 0, ""})) return -1;
  }
  return real<int(int)>(name)(file);
}

int watchedTruncate(const char* name, int file, off_t size) {
  if (watch) {
    const std::string path = pathOf(file);
    if (isWatched(path) && !mayHappen({Kind::kTruncate, path, "", size, ""})) return -1;
  }
  return real<int(int, off_t)>(name)(file, size);
}

int watchedRemove(const char* name, const char* path) {
  if (isWatched(path) && access(path, F_OK) == 0 && !mayHappen({Kind::kRemove, path, "", 0, ""})) return -1;
  return real<int(const char*)>(name)(path);
}

}  // namespace

WatchedDisk::WatchedDisk(const std::string& folder, Watcher watcher) {
  watch = new Watch{folder + "/", std::move(watcher)};
}

WatchedDisk::~WatchedDisk() {
  delete watch;
  watch = nullptr;
}

}  // namespace bki_mapping

// In place of the C library's functions, with its exception specifications.
extern "C" {
int open(const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(rest, mode_t) : 0;
  va_end(rest);
  return bki_mapping::watchedOpen("open", path, flags, mode);
}
int open64(const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(rest, mode_t) : 0;
  va_end(rest);
  return bki_mapping::watchedOpen("open64", path, flags, mode);
}
ssize_t write(int file, const void* bytes, std::size_t size) {
  return bki_mapping::watchedWrite(file, bytes, size, lseek(file, 0, SEEK_CUR), [&] {
    return bki_mapping::real<ssize_t(int, const void*, std::size_t)>("write")(file, bytes, size);
  });
}
ssize_t pwrite(int file, const void* bytes, std::size_t size, off_t position) {
  return bki_mapping::watchedWrite(file, bytes, size, position, [&] {
    return bki_mapping::real<ssize_t(int, const void*, std::size_t, off_t)>("pwrite")(file, bytes, size,
                                                                                      position);
  });
}
ssize_t pwrite64(int file, const void* bytes, std::size_t size, off64_t position) {
  return bki_mapping::watchedWrite(file, bytes, size, position, [&] {
    return bki_mapping::real<ssize_t(int, const void*, std::size_t, off64_t)>("pwrite64")(file, bytes, size,
                                                                                          position);
  });
}
int ftruncate(int file, off_t size) noexcept {
  return bki_mapping::watchedTruncate("ftruncate", file, size);
}
int ftruncate64(int file, off64_t size) noexcept {
  return bki_mapping::watchedTruncate("ftruncate64", file, size);
}
int fsync(int file) {
  return bki_mapping::watchedSync("fsync", file);
}
int fdatasync(int file) {
  return bki_mapping::watchedSync("fdatasync", file);
}
int unlink(const char* path) noexcept {
  return bki_mapping::watchedRemove("unlink", path);
}
int remove(const char* path) noexcept {
  return bki_mapping::watchedRemove("remove", path);
}
int rename(const char* path, const char* target) noexcept {
  using namespace bki_mapping;
  if (isWatched(path) && !mayHappen({DiskCall::Kind::kRename, path, target, 0, ""})) return -1;
  return real<int(const char*, const char*)>("rename")(path, target);
}
}
