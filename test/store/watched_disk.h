/// @file What a program does to the files of a folder, call by call: to be recorded, refused or cut short.
/// Stands between the program, with all its libraries, and the C library.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace bki_mapping {

/// A call that changes files.
struct DiskCall {
  enum class Kind {
    kCreate,
    kWrite,
    kTruncate,
    kSync,        ///< of a file
    kSyncFolder,  ///< of the names in a folder
    kRename,      ///< a file that has the other name is replaced
    kRemove,
  };
  Kind kind;
  std::string path;           ///< of the file or folder
  std::string target;         ///< of kRename
  std::int64_t position = 0;  ///< of kWrite; of kTruncate, the new size
  std::string bytes;          ///< of kWrite
};

/// Watches a folder while it lives. One at a time.
class WatchedDisk {
 public:
  /// Is called before each call; returns 0 to let it happen, or the errno that it shall fail with.
  using Watcher = std::function<int(const DiskCall&)>;

  WatchedDisk(const std::string& folder, Watcher watcher);
  ~WatchedDisk();
  WatchedDisk(const WatchedDisk&) = delete;
  WatchedDisk& operator=(const WatchedDisk&) = delete;
};

}  // namespace bki_mapping
