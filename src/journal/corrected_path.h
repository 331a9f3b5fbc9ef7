/// @file Corrected poses of a trajectory, and what they mean for scans between them.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <set>
#include <vector>

namespace bki_mapping {

struct StampedMotion {
  std::uint64_t stamp;  ///< [ns]
  Eigen::Isometry3d motion;
};

/// The poses of keyframes as a pose graph has corrected them. Scans move with the keyframes beside them, so
/// that odometry keeps its local shape:
///
///     T_map_new(t) = C(t) T_recorded(t)     with  C(t_k) = T_map_keyframe(t_k) T_recorded(t_k)^-1
///
/// and C between two keyframes on the screw from one to the other (between()); before the first keyframe and
/// after the last, C is theirs. A recorded pose between two scans lies on the screw between theirs.
///
/// Where recorded poses jump, the trajectory is cut: no pose is interpolated across a jump, and what lies
/// between two jumps, or after the last, moves only if a keyframe lies there as well.
class CorrectedPath {
 public:
  /// Keyframes outside of the recorded poses, or between two that are farther apart than this, are left out:
  /// the way there is not known [ns].
  static constexpr std::uint64_t kLongestGap = 2'000'000'000;

  /// Without keyframes: nothing is corrected.
  CorrectedPath() = default;
  /// @param keyframes poses of a frame of the robot in the map frame, in any order; of two with the same
  /// stamp the later one counts. @param recorded poses of the same frame, by rising stamp.
  /// @param jumps the stamps of the first poses after jumps of the recorded poses.
  CorrectedPath(std::vector<StampedMotion> keyframes, const std::vector<StampedMotion>& recorded,
                const std::set<std::uint64_t>& jumps = {});

  bool empty() const { return corrections_.empty(); }
  /// Number of keyframes that are used.
  std::size_t size() const { return corrections_.size(); }
  /// C at a time; nullopt where nothing is corrected.
  std::optional<Eigen::Isometry3d> correctionAt(std::uint64_t stamp) const;
  /// roundedPose() of the corrected pose C(t) T_recorded(t); nullopt where nothing is corrected.
  std::optional<Eigen::Isometry3d> poseAt(std::uint64_t stamp, const Eigen::Isometry3d& T_recorded) const;

 private:
  std::vector<StampedMotion> corrections_;  ///< C at the keyframes, by rising stamp
  std::set<std::uint64_t> jumps_;
};

}  // namespace bki_mapping
