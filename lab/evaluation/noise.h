/// @file Wrong labels and poses, to measure how well a map copes with them.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/scan.h"

namespace bki_mapping {

/// Which labels are wrong, and what they say. "Similar" classes have the same flags `dynamic` and `ground`:
/// vehicles, riders and persons are similar, and so are poles, trunks and walls.
enum class LabelErrors {
  kEven,     ///< any label; any other class
  kSimilar,  ///< any label; a similar class
  kObjects,  ///< all labels of a class within a cube of 2 m, for object_seconds; a similar class
  kBorders,  ///< labels of points within a cube of 0.5 m in which there are several classes; one of these
  kFar,  ///< any label, the more often the farther: at 20 m with the probability asked for; a similar class
  kNetwork,  ///< as networks err: kObjects with half the probability; else kBorders; else kFar with half of
             ///< it
};
/// "even", "similar", "objects", "borders", "far" or "network". @throws std::invalid_argument for another
/// name.
LabelErrors labelErrorsNamed(const std::string& name);

struct LabelNoise {
  double rate = 0.0;  ///< probability of an error, 0 to 1
  LabelErrors errors = LabelErrors::kEven;
  std::uint64_t seed = 1;
  double object_seconds = 1.0;  ///< how long an object keeps its wrong label, at least 0.001 [s]
};

/// The labels of a scan with errors. Equal seeds, stamps and scans give equal labels.
std::vector<std::uint32_t> withLabelNoise(const Scan& scan, const ClassTable& classes,
                                          const LabelNoise& noise);

/// Adds errors to poses: of equal size along and about each axis of the sensor, normally distributed.
class PoseNoise {
 public:
  enum class Kind {
    kWhite,  ///< each pose is wrong by itself
    kDrift,  ///< each step from pose to pose is wrong, as in odometry, so that errors add up
  };

  /// @param position, angle standard deviations [m, rad].
  PoseNoise(Kind kind, double position, double angle, std::uint64_t seed)
      : kind_(kind), position_(position), angle_(angle), seed_(seed) {}

  /// The next pose with its error. The first pose does not drift.
  Eigen::Isometry3d next(const Eigen::Isometry3d& T_map_sensor);

 private:
  Eigen::Isometry3d error() const;

  Kind kind_;
  double position_, angle_;
  std::uint64_t seed_, count_ = 0;
  Eigen::Isometry3d last_true_ = Eigen::Isometry3d::Identity(), last_noisy_ = Eigen::Isometry3d::Identity();
};

}  // namespace bki_mapping
