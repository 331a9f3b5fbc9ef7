#include "journal/corrected_path.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "journal/rigid_motion.h"
#include "journal/sensor_scan.h"

namespace bki_mapping {
namespace {

using Position = std::vector<StampedMotion>::const_iterator;

bool isEarlier(const StampedMotion& a, const StampedMotion& b) {
  return a.stamp < b.stamp;
}

/// Whether the recorded poses jump between two stamps.
bool jumpsBetween(const std::set<std::uint64_t>& jumps, std::uint64_t earlier, std::uint64_t later) {
  const auto next = jumps.upper_bound(earlier);
  return next != jumps.end() && *next <= later;
}

/// The motions before and after a time, of which either may be missing: at the end of the list, or beyond a
/// jump. If one is of that time, it is both.
struct Beside {
  Position before, after;
};
Beside beside(const std::vector<StampedMotion>& motions, const std::set<std::uint64_t>& jumps,
              std::uint64_t stamp) {
  const auto end = motions.end();
  auto after =
      std::lower_bound(motions.begin(), end, stamp,
                       [](const StampedMotion& motion, std::uint64_t s) { return motion.stamp < s; });
  if (after != end && after->stamp == stamp) return {after, after};
  auto before = after == motions.begin() ? end : after - 1;
  if (after != end && jumpsBetween(jumps, stamp, after->stamp)) after = end;
  if (before != end && jumpsBetween(jumps, before->stamp, stamp)) before = end;
  return {before, after};
}

/// The motion at a time between two others.
Eigen::Isometry3d onScrew(const StampedMotion& before, const StampedMotion& after, std::uint64_t stamp) {
  if (before.stamp == after.stamp) return before.motion;
  return between(before.motion, after.motion,
                 static_cast<double>(stamp - before.stamp) / static_cast<double>(after.stamp - before.stamp));
}

/// The recorded pose at a time, if the recorded poses beside it are near enough.
std::optional<Eigen::Isometry3d> recordedAt(const std::vector<StampedMotion>& recorded,
                                            const std::set<std::uint64_t>& jumps, std::uint64_t stamp) {
  const auto [before, after] = beside(recorded, jumps, stamp);
  if (before == recorded.end() || after == recorded.end()) return std::nullopt;
  if (after->stamp - before->stamp > CorrectedPath::kLongestGap) return std::nullopt;
  return onScrew(*before, *after, stamp);
}

}  // namespace

CorrectedPath::CorrectedPath(std::vector<StampedMotion> keyframes, const std::vector<StampedMotion>& recorded,
                             const std::set<std::uint64_t>& jumps)
    : jumps_(jumps) {
  std::stable_sort(keyframes.begin(), keyframes.end(), isEarlier);
  for (const StampedMotion& keyframe : keyframes) {
    const auto pose = recordedAt(recorded, jumps, keyframe.stamp);
    if (!pose) continue;
    if (!corrections_.empty() && corrections_.back().stamp == keyframe.stamp) corrections_.pop_back();
    corrections_.push_back({keyframe.stamp, keyframe.motion * pose->inverse()});
  }
}

std::optional<Eigen::Isometry3d> CorrectedPath::correctionAt(std::uint64_t stamp) const {
  const auto [before, after] = beside(corrections_, jumps_, stamp);
  const auto end = corrections_.end();
  if (before == end && after == end) return std::nullopt;
  if (before == end) return after->motion;
  if (after == end) return before->motion;
  return onScrew(*before, *after, stamp);
}

std::optional<Eigen::Isometry3d> CorrectedPath::poseAt(std::uint64_t stamp,
                                                       const Eigen::Isometry3d& T_recorded) const {
  const auto correction = correctionAt(stamp);
  if (!correction) return std::nullopt;
  return roundedPose(*correction * T_recorded);
}

}  // namespace bki_mapping
