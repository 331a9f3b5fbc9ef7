/// @file The reference for every fast path: brute-force sums in double precision, written directly from the
/// formulas of docs/method.md.
#pragma once

#include <map>
#include <tuple>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/grid_geometry.h"
#include "bki_mapping/core/scan.h"
#include "bki_mapping/map/block.h"
#include "bki_mapping/mapping/mapper_config.h"

namespace bki_mapping::reference {

/// A sum, and the part of it (slack) whose comparisons are too close to decide in single precision.
struct Value {
  double sum = 0.0;
  double slack = 0.0;
  int beams = 0;  ///< number of beams that reach the voxel

  /// Greatest error of the sum in single precision. The term in `beams` covers voxels that many beams barely
  /// reach: the sum is small, but each beam contributes rounding errors in proportion to the kernel's scale.
  /// Half a unit is for rounding the sum.
  double tolerance(double scale) const {
    return 2e-5 * scale + 2e-7 * scale * beams + 2e-5 * sum + slack +
           0.5 * static_cast<double>(kEvidenceUnit);
  }
};

struct Point {
  Eigen::Vector3d p;  ///< relative to the sensor [m]
  int label;
  std::map<int, double> shares = {};  ///< soft labels; empty for a hard label

  double shareOf(int id) const {
    if (shares.empty()) return id == label ? 1.0 : 0.0;
    const auto found = shares.find(id);
    return found == shares.end() ? 0.0 : found->second;
  }
};

/// k(d), Equation (1). @param d, length [m].
double sparseKernel(double d, double length, double scale);

std::vector<Point> downsample(const Eigen::Vector3d& origin, const std::vector<Point>& points, double cell);

/// Equation 3b: for each point relative to the sensor [m], whether it is isolated. Compares each with each.
std::vector<bool> isolatedPoints(const std::vector<Eigen::Vector3f>& points, double within);

/// The evidence of one scan, summed at any voxel on request.
class ScanReference {
 public:
  ScanReference(const Scan& scan, const ClassTable& classes, const MapperConfig& config);

  /// Evidence that this scan adds to a class (kFreeClass for free) at a voxel.
  Value evidence(const VoxelIndex& voxel, ClassId label) const;
  /// Whether the scan sees a voxel only beyond the ends of beams: 1 yes, 0 crossed, -1 not reached, -2 too
  /// close to decide. Voxels are marked up to `range` from the sensor [m].
  int occluded(const VoxelIndex& voxel, double range) const;

  const std::vector<Point>& hits() const { return hits_; }
  const std::vector<Point>& samples() const { return samples_; }
  const std::vector<Eigen::Vector3d>& beams() const { return beams_; }

 private:
  Value unlimited(const VoxelIndex& voxel, ClassId label) const;
  enum class Answer { kNo, kUndecided, kYes };
  struct Seen {
    Answer crossed;
    Answer bounds;  ///< hits add evidence, but those of classes that can move lie in other voxels
    Answer hit;     ///< hits add evidence
    Answer holds;   ///< contains a hit
  };
  /// What the scan says of one voxel, for isVoid.
  Seen seen(const VoxelIndex& voxel) const;
  /// Whether the scan adds evidence to the block of a voxel.
  bool isUpdated(const VoxelIndex& voxel) const;
  /// Whether the scan sees a voxel empty: beams cross it, or the voxels below and above it.
  Answer isEmpty(const VoxelIndex& voxel) const;
  /// Whether the scan sees the voxel and its neighbours across faces and edges empty.
  Answer isVoid(const VoxelIndex& voxel) const;
  /// Whether it contains a hit above a voxel that the scan sees empty.
  Answer isThin(const VoxelIndex& voxel) const;
  /// Whether it contains a hit, and takes evidence from hits of what can move.
  Answer isMoving(const VoxelIndex& voxel) const;
  Eigen::Vector3d relativeCentre(const VoxelIndex& voxel) const;
  Value pointEvidence(const std::vector<Point>& points, const VoxelIndex& voxel, int label) const;
  /// Whether hits of a class add evidence to voxels that do not contain them.
  bool spreads(const SemanticClass& c) const;
  /// Evidence of the hits of one class.
  Value hitEvidence(const VoxelIndex& voxel, const SemanticClass& c) const;
  /// The evidence of all hits, whatever their class.
  Value anyHit(const VoxelIndex& voxel) const;
  Value lineEvidence(const VoxelIndex& voxel) const;
  bool blockIsHit(const BlockIndex& block) const;
  /// Sets the threshold of free space. @param height of the sensor [m]; 0: found from the hits on ground.
  void setThreshold(double height);
  void drawSamples(std::uint64_t stamp);
  /// Whether the beam's line reaches the voxel; sets rho and k there.
  bool reaches(const Eigen::Vector3d& beam, const Eigen::Vector3d& centre, double& rho, double& k) const;

  MapperConfig config_;
  GridGeometry geometry_;
  Eigen::Vector3d origin_;
  std::vector<Point> hits_, samples_;
  std::vector<Eigen::Vector3d> beams_;
  std::vector<SemanticClass> classes_;
  mutable std::map<std::tuple<int, int, int>, bool> hit_blocks_;
  mutable std::map<std::tuple<int, int, int>, Seen> seen_;
};

}  // namespace bki_mapping::reference
