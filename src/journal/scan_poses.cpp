#include "journal/scan_poses.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <set>
#include <stdexcept>
#include <utility>

#include "bki_mapping/core/named_parameter.h"
#include "core/counted.h"

namespace bki_mapping {
namespace {

/// A pose belongs to a scan if their stamps differ by no more: files hold rounded times [ns].
constexpr std::uint64_t kSameTime = 1'000'000;

std::string secondsText(std::uint64_t stamp) {
  return numberText(std::round(static_cast<double>(stamp) * 1e-6) * 1e-3);
}

/// A stamp, or that of the scan that it belongs to. @param stamps of the scans, sorted.
std::uint64_t ofScan(std::uint64_t stamp, const std::vector<std::uint64_t>& stamps) {
  const auto next = std::lower_bound(stamps.begin(), stamps.end(), stamp);
  if (next != stamps.end() && *next - stamp <= kSameTime) return *next;
  if (next != stamps.begin() && stamp - *std::prev(next) <= kSameTime) return *std::prev(next);
  return stamp;
}

/// Zero of the clock of scans. Scans of a sequence have no name of a sensor, and stamps after kFirstStamp.
std::uint64_t zeroOf(const std::vector<ScanRecord>& scans) {
  return scans.front().sensor.empty() ? Sequence::kFirstStamp : 0;
}

}  // namespace

std::vector<Eigen::Isometry3d> wantedPoses(const std::vector<ScanRecord>& scans,
                                           std::vector<StampedMotion> keyframes, const std::string& name,
                                           std::uint64_t zero) {
  std::vector<StampedMotion> recorded;
  std::vector<std::uint64_t> stamps;
  std::set<std::uint64_t> jumps;
  for (const ScanRecord& scan : scans) {
    if (scan.sensor != scans.front().sensor) {
      throw std::invalid_argument("the drive has scans of several sensors, '" + scans.front().sensor +
                                  "' and '" + scan.sensor +
                                  "', and poses with stamps are of one; give a matrix for each scan");
    }
    recorded.push_back({scan.stamp, scan.T_odometry_sensor});
    stamps.push_back(scan.stamp);
    if (scan.jump) jumps.insert(scan.stamp);
  }
  std::sort(stamps.begin(), stamps.end());
  std::stable_sort(recorded.begin(), recorded.end(),
                   [](const StampedMotion& a, const StampedMotion& b) { return a.stamp < b.stamp; });
  for (StampedMotion& keyframe : keyframes) keyframe.stamp = ofScan(keyframe.stamp, stamps);
  const CorrectedPath corrected(keyframes, recorded, jumps);
  if (corrected.empty()) {
    throw std::invalid_argument("no pose of " + name + " has a stamp among those of the scans, from " +
                                secondsText(stamps.front() - std::min(zero, stamps.front())) + " to " +
                                secondsText(stamps.back() - std::min(zero, stamps.back())) +
                                " s; give poses with stamps of the same clock");
  }
  std::vector<Eigen::Isometry3d> wanted;
  for (const ScanRecord& scan : scans) {
    wanted.push_back(corrected.poseAt(scan.stamp, scan.T_odometry_sensor).value_or(scan.T_map_sensor));
  }
  return wanted;
}

std::vector<Eigen::Isometry3d> wantedPoses(const std::vector<ScanRecord>& scans, const LidarPoses& poses,
                                           const std::string& path) {
  if (!poses.seconds.empty()) {
    const std::uint64_t zero = zeroOf(scans);
    std::vector<StampedMotion> keyframes;
    for (std::size_t n = 0; n < poses.poses.size(); ++n) {
      const double stamp = std::round(poses.seconds[n] * 1e9) + static_cast<double>(zero);
      keyframes.push_back({static_cast<std::uint64_t>(std::clamp(stamp, 0.0, 9e18)), poses.poses[n]});
    }
    return wantedPoses(scans, std::move(keyframes), path, zero);
  }
  if (poses.poses.size() == scans.size()) return poses.poses;
  throw std::invalid_argument(path + " has " + counted(poses.poses.size(), "pose") + ", but drive '" +
                              scans.front().drive + "' has " + counted(scans.size(), "scan") +
                              " in the journal; give a pose for each, or poses with stamps");
}

}  // namespace bki_mapping
