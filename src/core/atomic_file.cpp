#include "core/atomic_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <random>

namespace bki_mapping {
namespace {

namespace fs = std::filesystem;

constexpr char kMark[] = ".bki_mapping-";
constexpr char kSuffixLetters[] = "abcdefghijklmnopqrstuvwxyz0123456789";
constexpr std::size_t kSuffixLength = 6;
/// Length of the mark, the longest process id, a dash and the suffix.
constexpr std::size_t kLongestTail = sizeof(kMark) - 1 + 10 + 1 + kSuffixLength;

fs::path folderOf(const fs::path& file) {
  return file.has_parent_path() ? file.parent_path() : fs::path(".");
}

const char* kindOf(mode_t mode) {
  if (S_ISDIR(mode)) return "a folder";
  if (S_ISFIFO(mode)) return "a pipe";
  if (S_ISSOCK(mode)) return "a socket";
  return "a device";
}

/// Resolves links, also those to a file that does not exist yet. @param old status of the file, if `exists`.
fs::path followLinks(const std::string& path, bool& exists, struct stat& old) {
  exists = stat(path.c_str(), &old) == 0;
  if (exists && !S_ISREG(old.st_mode)) {
    throw std::runtime_error(path + " is " + kindOf(old.st_mode) + ", not a regular file; give another name");
  }
  if (exists) return fs::canonical(path);
  if (errno == ELOOP) throw writeFailure(path, "it is in a loop of links");
  if (errno != ENOENT) throw writeFailure(path, std::strerror(errno));
  fs::path target = path;
  while (fs::is_symlink(fs::symlink_status(target))) target = folderOf(target) / fs::read_symlink(target);
  if (!target.has_filename()) throw writeFailure(path, "it does not name a file");
  return target;
}

/// Common prefix of the temporary files of a target; shortened to keep within the file system's name limit.
std::string temporaryPrefix(const fs::path& target) {
  const long limit = pathconf(folderOf(target).c_str(), _PC_NAME_MAX);
  const std::size_t max_length = std::max<std::size_t>(limit > 0 ? static_cast<std::size_t>(limit) : 255, 64);
  return "." + target.filename().string().substr(0, max_length - 1 - kLongestTail) + kMark;
}

std::string randomSuffix() {
  std::random_device random;
  std::uniform_int_distribution<std::size_t> letter(0, sizeof(kSuffixLetters) - 2);
  std::string suffix;
  while (suffix.size() < kSuffixLength) suffix += kSuffixLetters[letter(random)];
  return suffix;
}

/// Whether a temporary file of this user was left by a process that has ended.
bool isAbandoned(const fs::path& temporary, pid_t process) {
  const int file = open(temporary.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (file < 0) return false;
  struct stat status {};
  const bool own = fstat(file, &status) == 0 && S_ISREG(status.st_mode) && status.st_uid == geteuid();
  const bool acquired = flock(file, LOCK_EX | LOCK_NB) == 0, locked = !acquired && errno == EWOULDBLOCK;
  close(file);
  const bool gone = kill(process, 0) != 0 && errno == ESRCH;
  // In a container every run may have the same process id. A file of this process is locked before it has
  // content, so that an unlocked file with content is from an earlier run.
  const bool of_earlier_run = process == getpid() && acquired && status.st_size > 0;
  return own && !locked && (gone || of_earlier_run);
}

void removeAbandoned(const fs::path& folder, const std::string& prefix) {
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().filename().string();
    if (name.compare(0, prefix.size(), prefix) != 0) continue;
    pid_t process = 0;
    const char* const end = name.data() + name.size();
    const auto [dash, error] = std::from_chars(name.data() + prefix.size(), end, process);
    if (error != std::errc() || process <= 0 || end - dash != 1 + kSuffixLength || *dash != '-') continue;
    if (!std::all_of(dash + 1, end, [](unsigned char c) { return std::isalnum(c); })) continue;
    if (isAbandoned(entry.path(), process)) unlink(entry.path().c_str());
  }
}

/// Gives a new file the owner and group of the one it replaces, as far as this user has the right to.
void keepOwner(int file, const struct stat& old) {
  [[maybe_unused]] const int group = fchown(file, static_cast<uid_t>(-1), old.st_gid);
  [[maybe_unused]] const int user = fchown(file, old.st_uid, static_cast<gid_t>(-1));
}

}  // namespace

std::runtime_error writeFailure(const std::string& path, const std::string& reason) {
  struct statvfs disk {};
  std::string space;
  if (statvfs(folderOf(path).c_str(), &disk) == 0) {
    char text[64];
    const double bytes = static_cast<double>(disk.f_bavail) * static_cast<double>(disk.f_frsize);
    std::snprintf(text, sizeof(text), " (%.1f MB free there)", bytes / 1e6);
    space = text;
  }
  return std::runtime_error(path + " cannot be written: " + reason + space +
                            "; check folder, rights and free space");
}

AtomicFile::AtomicFile(const std::string& path) : path_(path) {
  bool exists = false;
  struct stat old {};
  const fs::path target = followLinks(path, exists, old);
  target_ = target.string();
  const std::string prefix = temporaryPrefix(target);
  removeAbandoned(folderOf(target), prefix);
  do {
    temporary_ = (folderOf(target) / (prefix + std::to_string(getpid()) + "-" + randomSuffix())).string();
    // The kernel applies the umask. Before it replaces a file, 0600 keeps the content private until commit().
    file_ = open(temporary_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, exists ? 0600 : 0666);
  } while (file_ < 0 && errno == EEXIST);
  if (file_ < 0) throw writeFailure(path_, std::strerror(errno));
  flock(file_, LOCK_EX | LOCK_NB);  // optional: without locks, isAbandoned relies on the process id
  struct stat made {};
  fstat(file_, &made);
  mode_ = (exists ? old : made).st_mode & 0777;
  if (exists) keepOwner(file_, old);
}

AtomicFile::~AtomicFile() {
  if (!committed_) std::remove(temporary_.c_str());
  close(file_);
}

void AtomicFile::write(const std::string& bytes) {
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t count = ::write(file_, bytes.data() + done, bytes.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throw writeFailure(path_, std::strerror(errno));
    done += static_cast<std::size_t>(count);
  }
}

void AtomicFile::commit() {
  fchmod(file_, mode_);  // fails where a file system has no permissions
  if (fsync(file_) != 0) throw writeFailure(path_, std::strerror(errno));
  if (std::rename(temporary_.c_str(), target_.c_str()) != 0) {
    throw writeFailure(path_, std::strerror(errno));
  }
  committed_ = true;
  syncFolder(target_);
}

void syncFolder(const std::string& path) {
  const int opened = open(folderOf(path).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (opened < 0) return;
  const int reason = fsync(opened) == 0 ? 0 : errno;
  close(opened);
  if (reason == EIO || reason == ENOSPC || reason == EDQUOT) throw writeFailure(path, std::strerror(reason));
}

void checkWritable(const std::string& path) {
  const AtomicFile file(path);
}

void writeTextFile(const std::string& path, const std::string& text) {
  AtomicFile file(path);
  file.write(text);
  file.commit();
}

}  // namespace bki_mapping
