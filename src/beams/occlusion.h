/// @file Marks the voxels that a scan saw only beyond the ends of its beams.
#pragma once

#include "beams/beam_field.h"
#include "beams/block_walk.h"
#include "update/evidence.h"

namespace bki_mapping {

/// Marks the voxels that lie beyond the end of some beam (rho >= 1) and that no beam of this scan crosses
/// (0 < rho < 1). A crossed voxel loses its mark; a voxel that no beam reaches keeps it.
class Occlusion : public BlockPass {
 public:
  explicit Occlusion(OcclusionExtent extent) : extent_(extent) {}

  /// Replaces the beams. @param field must stay valid until the scan is done. @param range distance from the
  /// sensor up to which voxels are marked [m].
  void setField(const BeamField& field, double range) {
    field_ = &field;
    range_ = range;
  }

  const std::vector<GridIndex>& touchedBlocks(const SemanticMap& map, std::size_t most,
                                              ThreadPool& pool) override;
  void reserve(std::size_t workers) override;
  void apply(const GroupBlock& block, std::size_t worker, Block& to) override;

 private:
  /// Working memory of one thread.
  struct alignas(kThreadsApart) Workspace {
    NearBeams near;
  };

  OcclusionExtent extent_;
  const BeamField* field_ = nullptr;
  double range_ = 0.0;
  BlockWalk walk_;
  std::vector<GridIndex> listed_;  ///< may list a block twice
  IndexNumbering touched_;
  std::vector<Workspace> workspaces_;
};

}  // namespace bki_mapping
