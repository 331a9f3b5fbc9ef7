/// @file Files that appear whole or not at all.
#pragma once

#include <string>

namespace bki_mapping {

/// A new file under a temporary name beside its place. commit() puts it there in one step; without it, the
/// file that was there before stays, and the temporary one is removed.
class AtomicFile {
 public:
  /// @throws std::runtime_error if the folder cannot be written to.
  explicit AtomicFile(const std::string& path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// Where to write.
  const std::string& temporaryPath() const { return temporary_; }
  /// @throws std::runtime_error if the data cannot reach the disk, or the place cannot be taken.
  void commit();

 private:
  std::string path_, temporary_;
  bool committed_ = false;
};

/// Writes a text file whole or not at all. @throws std::runtime_error naming the file and the reason.
void writeTextFile(const std::string& path, const std::string& text);

}  // namespace bki_mapping
