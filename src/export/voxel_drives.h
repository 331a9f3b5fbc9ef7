/// @file Which drive a voxel is from.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "bki_mapping/rules/voxel_state.h"
#include "bki_mapping/store/map_file.h"

namespace bki_mapping {

/// Finds the drive that contributed most to a voxel. Where the file stores drives in parts of their own,
/// their evidence says so; for an occupied voxel, the evidence for classes. Drives that share a part, or that
/// only the sum holds, are told apart by their bounding boxes, if only one of these contains the voxel.
class VoxelDrives {
 public:
  static constexpr std::uint8_t kNotKnown = 0;
  using Codes = std::array<std::uint8_t, kBlockVoxels>;

  /// @param file that holds the drives in parts; nullptr if none does. Must outlive this.
  VoxelDrives(const std::vector<DriveRecord>& drives, MapFile* file);

  /// Whether there are drives to tell apart: from 2 to 255.
  bool any() const { return drives_.size() > 1; }
  /// Reads the parts of a tile, for the blocks that follow. @throws MapFileError.
  void readTile(const GridIndex& tile);
  /// The position of the drive of each voxel, plus 1; kNotKnown where there is not a single one.
  /// @param block of the map, and `view` of it.
  Codes codesOf(const GridGeometry& geometry, const BlockIndex& index, const Block& block,
                const BlockView& view) const;

 private:
  std::vector<DriveRecord> drives_;
  MapFile* file_;
  std::map<int, std::vector<std::size_t>> drives_of_part_;  ///< part 0: the rest
  std::map<int, SemanticMap> tile_;                         ///< by part
};

}  // namespace bki_mapping
