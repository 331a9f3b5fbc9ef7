/// @file Computes what changes in a map when scans move to other poses.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "journal/sensor_scan.h"

namespace bki_mapping {

/// A scan of a journal at a pose.
struct PlacedJournalScan {
  std::uint64_t number;                          ///< in the journal
  std::shared_ptr<const std::string> packed;     ///< by packScan(); nullptr: it is in the map file
  std::shared_ptr<const MapperConfig> settings;  ///< with which it was integrated
  Eigen::Isometry3d T_map_sensor;
  /// Boxes that were cleared after it came into the map, in which it has no evidence (map frame [m]).
  std::vector<Eigen::AlignedBox3d> cleared;
};

/// The looks of blocks, by their region.
using LooksByRegion = std::map<GridIndex, LooksByBlock>;

/// A scan that is in the map at one pose, and belongs to another.
struct ScanMove {
  PlacedJournalScan scan;
  Eigen::Isometry3d to;  ///< T_map_sensor
};

/// Maps on the side, in one thread. Not thread-safe.
class ScanMover {
 public:
  /// Reads a packed scan from the map file by its number in the journal; may wait for the disk.
  using Fetch = std::function<std::string(std::uint64_t number)>;

  /// @param config of the map that is corrected. @param fetch may be empty if all scans are in memory.
  /// @throws as SemanticMapper.
  ScanMover(const MapperConfig& config, std::shared_ptr<const ClassTable> classes, Fetch fetch = {});

  struct Moved {
    /// Is to be added to the map: it holds the scans at their new poses, less the scans at their old ones.
    /// Its looks are those of the new poses, where its evidence is not 0.
    SemanticMap difference;
    LooksByRegion looks;  ///< of the scans at their new poses
    /// For each scan the regions that it touches at the new pose, sorted.
    std::vector<std::vector<GridIndex>> regions;
  };
  /// @param moves of scans with the same settings and the same cleared boxes.
  /// @throws what SemanticMapper::integrate throws, ScanDamaged, std::bad_alloc.
  Moved move(const std::vector<ScanMove>& moves);

  /// Adds what a scan saw of the blocks in some regions. @param looks of each of these regions.
  /// @throws as move().
  void addLooks(const PlacedJournalScan& scan, LooksByRegion& looks);

 private:
  void use(const PlacedJournalScan& scan);
  SensorScan unpack(const PlacedJournalScan& scan) const;

  std::shared_ptr<const ClassTable> classes_;
  std::unique_ptr<SemanticMapper> mapper_;
  Fetch fetch_;
  std::shared_ptr<const MapperConfig> settings_;  ///< that the mapper has now
};

/// The regions of blocks, sorted.
std::vector<GridIndex> regionsOf(const std::vector<GridIndex>& blocks);

}  // namespace bki_mapping
