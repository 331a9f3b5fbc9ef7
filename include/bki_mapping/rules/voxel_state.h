/// @file How the state of a voxel is decided, and its posterior. The paper has the posterior (10) and, with a
/// gain of 1, the state (11).
#pragma once

#include <array>
#include <initializer_list>
#include <utility>
#include <vector>

#include "bki_mapping/rules/state_rules.h"

namespace bki_mapping {

/// The state of a voxel. Files and messages use these values.
enum class VoxelState : std::uint8_t {
  kUnknown = 0,   ///< without evidence
  kFree = 1,      ///< with evidence, but StateRules do not keep it occupied
  kOccupied = 2,  ///< StateRules keep it occupied; by default, if some class has the largest alpha (11)
  kOccluded = 3,  ///< without evidence; the last scan to reach it saw it only beyond the ends of beams
};

/// A set of voxel states.
class VoxelStates {
 public:
  VoxelStates() = default;
  VoxelStates(std::initializer_list<VoxelState> states) {
    for (const VoxelState state : states) insert(state);
  }
  void insert(VoxelState state) { bits_ |= bitOf(state); }
  bool contains(VoxelState state) const { return (bits_ & bitOf(state)) != 0; }
  bool operator==(const VoxelStates& other) const { return bits_ == other.bits_; }

 private:
  static unsigned bitOf(VoxelState state) { return 1u << static_cast<unsigned>(state); }

  unsigned bits_ = 0;
};

/// Summary of the Dirichlet posterior of one voxel. Equations 10 to 13 in docs/method.md.
struct VoxelView {
  VoxelState state = VoxelState::kUnknown;
  ClassId label = kFreeClass;  ///< the class of an occupied voxel (ties: the smaller id), else kFreeClass
  float probability = 0.0f;    ///< p = alpha / sum(alpha) of `label`
  float variance = 0.0f;       ///< p (1 - p) / (sum(alpha) + 1)
  /// Probability that something is there; calibrated on drives whose truth is known. It is 0.029 to 0.91, and
  /// below a threshold that depends on the gain if the voxel is free (below 0.87 in any case).
  float occupancy = 0.0f;
  /// Probability of the likeliest class, given that something is there; in a free voxel, too. Wrong labels
  /// that are outvoted hardly lower it. 1 / number of classes without evidence for a class.
  float class_probability = 0.0f;
  float entropy = 0.0f;   ///< of the expected class distribution, over all classes and `free` [nat]
  float evidence = 0.0f;  ///< sum(alpha) minus the sum of the priors
};

/// What VoxelView says of each voxel of a block, by GridGeometry::offsetInBlock.
struct BlockView {
  template <typename T>
  using PerVoxel = std::array<T, kBlockVoxels>;

  PerVoxel<VoxelState> state;
  PerVoxel<ClassId> label;
  PerVoxel<float> probability, variance, occupancy, class_probability, entropy, evidence;

  /// One voxel. @param offset 0 to 511.
  VoxelView at(int offset) const {
    const auto v = static_cast<std::size_t>(offset);
    return {state[v],   label[v],   probability[v], variance[v], occupancy[v], class_probability[v],
            entropy[v], evidence[v]};
  }
};

/// The fields of a BlockView that readBlock computes; the others keep their values.
enum class BlockFields {
  kStates,         ///< state and label
  kAllButEntropy,  ///< takes up to twice as long as states
  kAll,            ///< takes three times as long as without entropy
};

/// Reads all voxels of a block, many times as fast as one by one. States and labels are those of viewVoxel;
/// the other fields differ from them by at most 1e-6 of their value.
/// @param map that the block is part of: states may depend on the blocks around it.
void readBlock(const SemanticMap& map, const StateRules& rules, const BlockIndex& index, const Block& block,
               BlockFields fields, BlockView& view);

/// The state and posterior of a voxel. @param map that the block is part of. @param offset of the voxel in
/// its block.
VoxelView viewVoxel(const SemanticMap& map, const StateRules& rules, const BlockIndex& index,
                    const Block& block, int offset);
/// The same with entropy 0, which is much faster: the logarithms take most of the time.
VoxelView viewWithoutEntropy(const SemanticMap& map, const StateRules& rules, const BlockIndex& index,
                             const Block& block, int offset);
/// The same for a voxel by index; unknown if the map has no block there.
VoxelView viewWithoutEntropy(const SemanticMap& map, const StateRules& rules, const VoxelIndex& voxel);
/// viewVoxel for the voxel that contains a point. @param point in the map frame [m].
VoxelView viewPoint(const SemanticMap& map, const StateRules& rules, const Eigen::Vector3d& point);

/// Calls visit(const VoxelIndex&, const VoxelView&) for every voxel that is not unknown, in sorted order. The
/// views have entropy 0.
template <typename Visit>
void forEachKnownVoxel(const SemanticMap& map, const StateRules& rules, Visit&& visit) {
  BlockView view;
  view.entropy.fill(0.0f);
  for (const auto& [index, block] : sortedBlocks(map)) {
    readBlock(map, rules, index, *block, BlockFields::kAllButEntropy, view);
    for (int offset = 0; offset < kBlockVoxels; ++offset) {
      const VoxelView voxel = view.at(offset);
      if (voxel.state != VoxelState::kUnknown) visit(GridGeometry::voxelOf(index, offset), voxel);
    }
  }
}

}  // namespace bki_mapping
