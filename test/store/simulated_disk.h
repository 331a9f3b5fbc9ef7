/// @file What is on a disk after a power failure.
#pragma once

#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "store/watched_disk.h"

namespace bki_mapping {

/// The files of a folder by name.
using Files = std::map<std::string, std::string>;

/// A disk that may lose what was not synced: of the writes to a file since its last sync any may be missing,
/// or of each any sectors; of the changes of a name in the folder since the folder was synced, the last ones.
/// Names are independent of each other, and syncing a file does not sync its name.
class SimulatedDisk {
 public:
  /// @param folder of all files. @param files that are there, durable.
  SimulatedDisk(const std::string& folder, const Files& files);

  void apply(const DiskCall& call);

  enum class Loss { kEverything, kNothing, kTheLast, kSome, kSectors };
  static constexpr Loss kLosses[] = {Loss::kEverything, Loss::kNothing, Loss::kTheLast, Loss::kSome,
                                     Loss::kSectors};
  /// The files that are there if the power fails now.
  Files cut(Loss loss, std::mt19937& random) const;

 private:
  static constexpr std::size_t kSector = 512;
  struct File {
    std::string durable;
    std::vector<DiskCall> pending;
  };
  using FilePointer = std::shared_ptr<File>;

  static void perform(const DiskCall& call, std::string& bytes);
  std::string contentAfter(const File& file, Loss loss, std::mt19937& random) const;
  void setName(const std::string& path, FilePointer file);
  std::string nameOf(const std::string& path) const { return path.substr(folder_.size() + 1); }

  std::string folder_;
  /// What each name may stand for: first what it does durably, last what it does now.
  std::map<std::string, std::vector<FilePointer>> names_;
};

}  // namespace bki_mapping
