/// @file Evidence for `free` from whole beams.
#pragma once

#include <string>

#include "beams/beam_field.h"
#include "beams/block_walk.h"
#include "beams/near_sensor.h"
#include "beams/raster/group_sums.h"
#include "beams/raster/line_kernels.h"
#include "update/evidence.h"

namespace bki_mapping {

/// Adds the sum over beams of w(rho) k(d) to `free`, Equations (6) and (7) of docs/method.md: d is the
/// distance of the voxel's centre from the beam's line, rho its projection on the beam, and w the weight
/// along the beam.
class LineEvidence : public Evidence {
 public:
  /// @param instruction_set one of instructionSets(); "" selects the best that the processor has.
  LineEvidence(BeamWeight weight, FreeSpaceExtent extent, const std::string& instruction_set = "")
      : weight_(weight), extent_(extent), kernels_(lineKernelsFor(instruction_set)), near_sensor_(kernels_) {}

  /// Replaces the beams. @param field must stay valid until the scan is done.
  void setField(const BeamField& field, ThreadPool& pool);

  void limitTo(float enough) override { enough_ = enough; }
  const std::vector<GridIndex>& touchedBlocks(const SemanticMap& map, std::size_t most,
                                              ThreadPool& pool) override;
  void markClasses(std::size_t, ClassSet& classes) const override { classes.set(kFreeClass); }
  void reserve(std::size_t workers) override;
  double cost(const BlockGroup& group) const override;
  /// Finds the beams near the group, sums them over its voxels, and hands over the sums block by block.
  void accumulate(const BlockGroup& group, const std::vector<GroupBlock>& blocks, std::size_t worker,
                  SumSink& sink) override;

 private:
  /// Working memory of one thread.
  struct alignas(kThreadsApart) Workspace {
    NearBeams near;
    GroupSums group;
    NearSensor::Workspace near_sensor;
  };
  /// Sums for the counting kernel: the weights of the beams that cross each voxel. @param sums of a block.
  void countCrossings(const BlockIndex& index, NearBeams& near, float* sums) const;

  const BeamField* field_ = nullptr;
  BeamWeight weight_;
  FreeSpaceExtent extent_;
  const LineKernels& kernels_;
  LineSetups lines_;
  NearSensor near_sensor_;
  float enough_ = std::numeric_limits<float>::infinity();
  BlockWalk walk_;
  std::vector<GridIndex> touched_;
  std::vector<Workspace> workspaces_;
};

}  // namespace bki_mapping
