/// @file Atomic writing of files: a reader sees the old file or the complete new one.
#pragma once

#include <sys/types.h>

#include <stdexcept>
#include <string>

namespace bki_mapping {

/// A temporary file in the target's folder, which commit() renames to the target. Without commit() the target
/// stays as it was, and the destructor removes the temporary file. A link is followed: it stays, and the file
/// it points to is replaced. The permissions and owner of a replaced file are kept; a new one follows the
/// umask. The constructor removes temporary files that killed processes left for the same target.
class AtomicFile {
 public:
  /// @throws std::runtime_error in one sentence if the folder cannot be written to, or if `path` is something
  /// other than a regular file: a folder, a device, a pipe or a loop of links.
  explicit AtomicFile(const std::string& path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// The file to write to. It must be written in place, not replaced: the lock belongs to this file.
  const std::string& temporaryPath() const { return temporary_; }
  /// Appends bytes. @throws std::runtime_error as writeFailure.
  void write(const std::string& bytes);
  /// @throws std::runtime_error as writeFailure if the data cannot reach the disk, or the renaming fails.
  void commit();

 private:
  std::string path_, target_, temporary_;
  int file_ = -1;  ///< the temporary file, open and locked until destruction
  mode_t mode_ = 0;
  bool committed_ = false;
};

/// An error with one sentence: the file, the reason, and the free space in its folder.
std::runtime_error writeFailure(const std::string& path, const std::string& reason);

/// Makes it durable that a file has got its name, or has lost it. Reports only errors of the disk: where a
/// file system or a folder does not support this, files are complete all the same.
/// @throws std::runtime_error as writeFailure.
void syncFolder(const std::string& path);

/// Checks that AtomicFile can be created, so that long work does not end in a result that cannot be written.
/// @throws std::runtime_error as AtomicFile's constructor.
void checkWritable(const std::string& path);

/// Writes a text file by AtomicFile. @throws std::runtime_error naming the file and the reason.
void writeTextFile(const std::string& path, const std::string& text);

}  // namespace bki_mapping
