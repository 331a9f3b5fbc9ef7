/// @file Times and poses of the scans of a sequence, from text files. Errors are std::runtime_error, in one
/// sentence with file and line.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "sequence/pose_file.h"

namespace bki_mapping {

/// The times of scans, by their numbers.
class ScanTimes {
 public:
  /// @param file times.txt; without it, scans are 0.1 s apart.
  explicit ScanTimes(const std::filesystem::path& file);

  /// Whether there is a file of times.
  bool given() const { return given_; }
  /// The time of a scan [s], from 0 to 4e9. @throws if it is missing or wrong.
  double of(std::size_t number, const std::string& scan) const;

 private:
  std::filesystem::path file_;
  bool given_;
  std::vector<std::vector<std::string>> lines_;  ///< words
};

/// The poses of scans: by their numbers or, where poses have stamps and scans have times, by their times.
class ScanPoses {
 public:
  /// @param timed whether scans have times. @throws if the file cannot be read.
  ScanPoses(const std::filesystem::path& file, bool timed);
  ScanPoses(const ScanPoses&) = delete;
  ScanPoses& operator=(const ScanPoses&) = delete;

  bool stamped() const { return file_.has_stamps; }
  /// The pose in the first line. @throws if there is none.
  Eigen::Isometry3d first() const;
  /// The pose of a scan. @throws if it is missing or wrong.
  Eigen::Isometry3d of(std::size_t number, const std::string& scan, double seconds) const;

 private:
  const PoseLine& at(double seconds, const std::string& scan) const;

  std::filesystem::path path_;
  PoseFile file_;
  std::map<double, const PoseLine*> by_time_;  ///< empty: lines belong to scans by their numbers
};

}  // namespace bki_mapping
