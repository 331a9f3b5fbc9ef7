#include "tools/scan_poses.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <set>
#include <stdexcept>

#include "bki_mapping/core/named_parameter.h"
#include "core/counted.h"
#include "journal/corrected_path.h"

namespace bki_mapping::tools {
namespace {

/// A pose belongs to a scan if their stamps differ by no more: files hold rounded times [ns].
constexpr std::uint64_t kSameTime = 1'000'000;

std::string secondsText(std::uint64_t stamp) {
  return numberText(std::round(static_cast<double>(stamp) * 1e-6) * 1e-3);
}

/// The stamp of a pose, or of the scan that it belongs to. @param stamps of the scans, sorted.
std::uint64_t stampOf(double seconds, std::uint64_t zero, const std::vector<std::uint64_t>& stamps) {
  const double nanoseconds = std::round(seconds * 1e9) + static_cast<double>(zero);
  const auto stamp = static_cast<std::uint64_t>(std::clamp(nanoseconds, 0.0, 9e18));
  const auto next = std::lower_bound(stamps.begin(), stamps.end(), stamp);
  if (next != stamps.end() && *next - stamp <= kSameTime) return *next;
  if (next != stamps.begin() && stamp - *std::prev(next) <= kSameTime) return *std::prev(next);
  return stamp;
}

/// Where scans belong by poses with stamps.
std::vector<Eigen::Isometry3d> alongPath(const std::vector<ScanRecord>& scans, const LidarPoses& poses,
                                         const std::string& path) {
  std::vector<StampedMotion> recorded, keyframes;
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
  // Scans of a sequence have no name of a sensor, and stamps after kFirstStamp.
  const std::uint64_t zero = scans.front().sensor.empty() ? Sequence::kFirstStamp : 0;
  for (std::size_t n = 0; n < poses.poses.size(); ++n) {
    keyframes.push_back({stampOf(poses.seconds[n], zero, stamps), poses.poses[n]});
  }
  const CorrectedPath corrected(keyframes, recorded, jumps);
  if (corrected.empty()) {
    throw std::invalid_argument("no pose of " + path + " has a stamp among those of the scans, from " +
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

}  // namespace

std::vector<Eigen::Isometry3d> wantedPoses(const std::vector<ScanRecord>& scans, const LidarPoses& poses,
                                           const std::string& path) {
  if (!poses.seconds.empty()) return alongPath(scans, poses, path);
  if (poses.poses.size() == scans.size()) return poses.poses;
  throw std::invalid_argument(path + " has " + counted(poses.poses.size(), "pose") + ", but drive '" +
                              scans.front().drive + "' has " + counted(scans.size(), "scan") +
                              " in the journal; give a pose for each, or poses with stamps");
}

}  // namespace bki_mapping::tools
