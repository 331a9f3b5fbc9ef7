/// @file The sums over beams near the sensor, where many beams pass each voxel.
#pragma once

#include <limits>
#include <vector>

#include "beams/beam_field.h"
#include "beams/longest_beams.h"
#include "beams/raster/group_sums.h"
#include "beams/raster/line_kernels.h"
#include "beams/split_directions.h"
#include "map/voxel_mask.h"
#include "update/sum_sink.h"

namespace bki_mapping {

/// Where rules limit what a scan adds, most sums near the sensor need not be known: a few of the beams
/// suffice to show that a voxel is full, and others, below the ground and behind walls, no beam reaches. The
/// other voxels are summed one by one. Which way a block takes depends on the scan and the block alone.
class NearSensor {
 public:
  /// Working memory of one thread.
  struct Workspace {
    GroupSums some;                            ///< sums over a part of the beams
    std::vector<BeamRange> some_ranges;        ///< those near the group
    BeamRange ranges[BeamTable::kMostRanges];  ///< of the beams near a voxel
    std::uint64_t blocks = 0;                  ///< of the group, those that are summed here
    struct Voxels {
      LayerBits full, open;  ///< open: to be summed
    };
    std::array<Voxels, kGroupBlocks> voxels;  ///< by slot
  };

  explicit NearSensor(const LineKernels& kernels) : kernels_(kernels) {}

  /// @param field, lines of the scan; must stay valid until it is done. @param enough sums of unit scale of
  /// which only counts that they are larger; infinity: nothing is near.
  void set(const BeamField& field, const LineSetups& lines, BeamWeight weight, float enough,
           ThreadPool& pool);
  void reserve(Workspace& own) const;

  /// Finds the blocks of a group that can be summed here, and their voxels. @param ranges of the beams near
  /// the group. @param is_protected the voxels of a block whose sums do not count.
  template <typename ProtectedIn>
  void start(const BlockGroup& group, const std::vector<GroupBlock>& blocks,
             const std::vector<BeamRange>& ranges, Workspace& own, ProtectedIn&& is_protected) const;
  /// Sets the sums of a block in own.blocks, times the scale of the kernel. Those of full voxels are any
  /// above enough; those of protected voxels are undefined, but not negative. @return whether any of them is
  /// above 0.
  bool sumsOf(const BlockIndex& index, Workspace& own, float* sums) const;

 private:
  /// Blocks that are near enough. @return those of the group.
  std::uint64_t blocksNear(const BlockGroup& group) const;
  /// Finds the full and the open voxels of a block. @return whether to sum the open ones one by one.
  bool look(const BlockIndex& index, const VoxelMask& is_protected, Workspace& own) const;
  bool isWorthwhile(int open, const BlockIndex& index) const;
  /// Removes voxels that no beam reaches.
  void dropUnreached(const BlockIndex& index, LayerBits& voxels) const;
  /// Of a block's first voxel, from the sensor [voxels].
  Eigen::Vector3d cornerOf(const BlockIndex& index) const;
  double distanceOf(const BlockIndex& index) const;  ///< of its centre [voxels]
  void sumSome(const BlockGroup& group, const std::vector<BeamRange>& ranges, Workspace& own) const;

  const LineKernels& kernels_;
  const LimitKernels& limits_ = limitKernelsFor("");
  const BeamField* field_ = nullptr;
  BeamWeight weight_ = BeamWeight::kBilinear;
  float enough_ = std::numeric_limits<float>::infinity();
  double density_ = 0.0;   ///< beams by steradian
  double farthest_ = 0.0;  ///< up to which distance blocks are near [voxels]
  LineSetups some_lines_;
  SplitDirections directions_;
  LongestBeams longest_;
};

template <typename ProtectedIn>
void NearSensor::start(const BlockGroup& group, const std::vector<GroupBlock>& blocks,
                       const std::vector<BeamRange>& ranges, Workspace& own,
                       ProtectedIn&& is_protected) const {
  own.blocks = 0;
  const BlockGroup near = {group.index, blocksNear(group)};
  if (near.blocks == 0) return;
  sumSome(near, ranges, own);
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const std::uint64_t bit = std::uint64_t{1} << slotInGroup(blocks[b].index);
    if ((near.blocks & bit) != 0 && look(blocks[b].index, is_protected(b), own)) own.blocks |= bit;
  }
}

}  // namespace bki_mapping
