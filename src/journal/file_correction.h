/// @file Moves scans of a map file: all of its map and its journal in memory.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "bki_mapping/store/map_file.h"
#include "journal/map_corrector.h"
#include "journal/stored_journal.h"

namespace bki_mapping {

/// The map in a file, as it is after scans of its journal have moved. The file is only read; what has changed
/// is to be written to it, or to a copy.
class FileCorrection {
 public:
  /// @param file whose journal has scans. @param tolerance scans that no point of which is farther off stay
  /// [m]. @throws MapFileError if the file cannot be read, or settings of its journal cannot be used;
  /// std::invalid_argument as MapCorrector; std::bad_alloc.
  FileCorrection(MapFile& file, double tolerance);

  /// Moves the scans of a drive, in the calling thread. @param wanted their poses, in order. @param progress
  /// is called with the number of scans that have moved, and of all that do.
  /// @return a sentence on looks that stay as they were; "" if there is nothing to be said.
  /// @throws MapFileError if a scan cannot be moved.
  std::string move(const std::string& drive, const std::vector<Eigen::Isometry3d>& wanted,
                   const std::function<void(std::size_t done, std::size_t all)>& progress = nullptr);

  /// Adds to a change the tiles, the scans and the drive that are new. @param all whether to write the
  /// tiles that have not changed, too.
  void write(MapFile::Change& change, const std::string& drive, bool all) const;

  std::size_t moved() const;                                       ///< number of scans
  double largestMove() const;                                      ///< of a point of a scan [m]
  const std::set<GridIndex>& changed() const { return changed_; }  ///< tiles

 private:
  std::vector<GridIndex> add(const SemanticMap& difference);
  bool hasMoved(std::size_t n) const;
  void putDrive(MapFile::Change& change, const std::string& drive) const;

  StoredMap stored_;
  std::set<GridIndex> changed_;
  std::function<void(std::size_t, std::size_t)> progress_;
  MapCorrector corrector_;
  std::vector<StoredAs> rows_;
  std::vector<Eigen::Isometry3d> before_;  ///< where the scans were
};

}  // namespace bki_mapping
