/// @file Files that appear whole or not at all.
#pragma once

#include <sys/types.h>

#include <stdexcept>
#include <string>

namespace bki_mapping {

/// A new file under a temporary name beside its place. commit() puts it there in one step; without it, the
/// file that was there before stays, and the temporary one is removed. Links are followed: they stay, and
/// what they point to is replaced. An old file's permissions and owner are kept, a new one honours the umask.
/// Temporaries that killed processes left for the same place are removed.
class AtomicFile {
 public:
  /// @throws std::runtime_error in one sentence if the folder cannot be written to, or if something other
  /// than a regular file (a folder, a device, a pipe, a loop of links) is at the place.
  explicit AtomicFile(const std::string& path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// Where to write; it must not be replaced by another file.
  const std::string& temporaryPath() const { return temporary_; }
  /// Appends bytes. @throws std::runtime_error as writeFailure.
  void write(const std::string& bytes);
  /// @throws std::runtime_error as writeFailure: the data cannot reach the disk, or the place be taken.
  void commit();

 private:
  std::string path_, target_, temporary_;
  int file_ = -1;  ///< the temporary file, open and locked for as long as this lives
  mode_t mode_ = 0;
  bool committed_ = false;
};

/// One sentence that names the file, the reason and the space that is free in its folder.
std::runtime_error writeFailure(const std::string& path, const std::string& reason);

/// @throws std::runtime_error as AtomicFile's constructor. Asked before long work, nothing is lost by it.
void checkWritable(const std::string& path);

/// Writes a text file whole or not at all. @throws std::runtime_error naming the file and the reason.
void writeTextFile(const std::string& path, const std::string& text);

}  // namespace bki_mapping
