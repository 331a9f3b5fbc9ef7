/// @file What a map file says about its map.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/grid_geometry.h"
#include "bki_mapping/map/semantic_map.h"

namespace bki_mapping {

/// A map file cannot be read or written: one sentence with the file, the fault and the remedy.
class MapFileError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};
/// The content of a map file is not what was written.
class MapFileDamaged : public MapFileError {
 public:
  using MapFileError::MapFileError;
};
/// A change whose MapFile::Change::commit() reported a failure has reached the file completely after all. It
/// must not be repeated.
class MapFileLateCommit : public MapFileError {
 public:
  using MapFileError::MapFileError;
};
/// The file is open elsewhere, in another process or in this one.
class MapFileInUse : public MapFileError {
 public:
  using MapFileError::MapFileError;
};

/// A unit of evidence is 2^-kUnitExponent.
constexpr int kUnitExponent = 16;
static_assert(kEvidenceUnit * (1 << kUnitExponent) == 1.0f);

/// What all tiles of a map file have in common; fixed when the file is created.
struct MapInfo {
  double resolution = 0.0;  ///< edge of a voxel [m], > 0
  double prior = 0.0;       ///< alpha0, concentration of each class before any scan, > 0
  int unit_exponent = kUnitExponent;
  std::string frame;                          ///< name of the map frame
  std::shared_ptr<const ClassTable> classes;  ///< never nullptr
  std::string parameters;  ///< the mapper's settings, for people and for resuming; YAML, at most 1 MB
  /// Name and version of the program that created the file; set by the library.
  std::string program;

  /// An empty map with this resolution, prior and number of classes, and without gains.
  SemanticMap emptyMap() const;
};

/// A drive whose scans are in a map.
struct DriveRecord {
  std::string id;    ///< identifies the drive in every map that contains it; not empty, at most 1 MB
  std::string name;  ///< for people
  /// 0: the file holds the drive's evidence only in the sum of all drives. > 0: the number of the part that
  /// also stores it separately; drives with the same number share a part.
  int part = 0;
  std::uint64_t scans = 0;
  std::uint64_t first_stamp = 0, last_stamp = 0;  ///< of the scans [ns], below 2^63
  Eigen::AlignedBox3d bounds;  ///< bounding box of the blocks that it touched, map frame [m]; may be empty

  bool operator==(const DriveRecord& other) const;

  /// Counts a scan. @param stamp of the scan [ns]. @param touched the blocks that it touched.
  void addScan(std::uint64_t stamp, const GridGeometry& geometry, const std::vector<GridIndex>& touched);
};

/// Checks that two maps can be added: they must have the same resolution, unit and prior, and classes with
/// the same ids and names. Colours and flags of classes may differ.
/// @param name, other_name names of the two maps for the error, such as their files.
/// @throws std::invalid_argument in one sentence with both values of the first difference.
void checkSameGrid(const std::string& name, const MapInfo& info, const std::string& other_name,
                   const MapInfo& other);

}  // namespace bki_mapping
