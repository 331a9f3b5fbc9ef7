#include "sequence/pose_agreement.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <utility>
#include <vector>

#include "bki_mapping/core/grid_geometry.h"
#include "bki_mapping/core/grid_table.h"
#include "bki_mapping/core/named_parameter.h"

namespace bki_mapping {
namespace {

constexpr std::size_t kPairs = 4;
/// Scans of a pair are at most this far apart, so that they see the same walls.
constexpr std::size_t kMostApart = 30;
constexpr double kDifference = 1.0;       ///< of the readings between the scans of a pair, if possible [m]
constexpr double kLeastDifference = 0.2;  ///< less tells nothing [m]
constexpr double kArm = 10.0;             ///< distance at which a turn counts as a shift [m]
constexpr double kCut = 0.5;              ///< greatest distance of points that counts [m]
constexpr std::size_t kPoints = 2000;     ///< that are compared, of a scan
constexpr float kNearest = 2.0f,
                kFarthest = 50.0f;  ///< ranges of the points [m]; nearer ones may be of the car

struct Pair {
  std::size_t from, to;
  double difference;  ///< of the readings [m]
};

Eigen::Isometry3d between(const Sequence& sequence, std::size_t from, std::size_t to) {
  return sequence.pose(from).inverse() * sequence.pose(to);
}

double differenceOf(const Sequence& a, const Sequence& b, std::size_t from, std::size_t to) {
  const Eigen::Isometry3d of_a = between(a, from, to), of_b = between(b, from, to);
  const double turn = Eigen::AngleAxisd(of_a.linear().transpose() * of_b.linear()).angle();
  return (of_a.translation() - of_b.translation()).norm() + kArm * std::abs(turn);
}

/// The pair that begins with a scan: with the next scan that is far enough, or the farthest.
Pair pairFrom(const Sequence& a, const Sequence& b, std::size_t from, std::size_t last) {
  Pair best{from, from, 0.0};
  const std::size_t end = std::min(last, from + 1 + kMostApart);
  for (std::size_t to = from + 1; to < end && best.difference < kDifference; ++to) {
    const double difference = differenceOf(a, b, from, to);
    if (difference > best.difference) best = {from, to, difference};
  }
  return best;
}

/// Pairs all along the range.
std::vector<Pair> choosePairs(const Sequence& a, const Sequence& b, std::size_t first, std::size_t last) {
  std::vector<Pair> pairs;
  for (std::size_t part = 0; part < kPairs; ++part) {
    const std::size_t begin = first + (last - first) * part / kPairs,
                      end = first + (last - first) * (part + 1) / kPairs;
    Pair best{begin, begin, 0.0};
    for (std::size_t from = begin; from < end && best.difference < kDifference; ++from) {
      const Pair pair = pairFrom(a, b, from, last);
      if (pair.difference > best.difference) best = pair;
    }
    if (best.difference >= kLeastDifference) pairs.push_back(best);
  }
  return pairs;
}

bool isUsed(const Eigen::Vector3f& point) {
  return point.allFinite() && point.norm() > kNearest && point.norm() < kFarthest;
}

/// The points of a scan, in cells as wide as the greatest distance that counts.
class Cells {
 public:
  explicit Cells(const std::vector<Eigen::Vector3f>& points) : grid_(kCut) {
    for (const Eigen::Vector3f& point : points) {
      if (!isUsed(point)) continue;
      const auto fresh = static_cast<std::uint32_t>(cells_.size());
      const std::uint32_t cell = table_.insert(grid_.voxelAt(point.cast<double>()), fresh);
      if (cell == fresh) cells_.emplace_back();
      cells_[cell].push_back(point);
    }
  }
  /// Distance to the nearest point [m], at most kCut.
  double distance(const Eigen::Vector3d& point) const {
    if (!grid_.contains(point)) return kCut;
    const VoxelIndex centre = grid_.voxelAt(point);
    double least = kCut * kCut;
    for (std::int32_t x = -1; x <= 1; ++x) {
      for (std::int32_t y = -1; y <= 1; ++y) {
        for (std::int32_t z = -1; z <= 1; ++z) {
          const std::uint32_t cell = table_.find({centre.x + x, centre.y + y, centre.z + z});
          if (cell == kNoPosition) continue;
          for (const Eigen::Vector3f& other : cells_[cell]) {
            least = std::min(least, (other.cast<double>() - point).squaredNorm());
          }
        }
      }
    }
    return std::sqrt(least);
  }

 private:
  GridGeometry grid_;
  GridTable table_;
  std::vector<std::vector<Eigen::Vector3f>> cells_;
};

/// The mean distance of points to those of an earlier scan.
double distanceTo(const Cells& earlier, const std::vector<Eigen::Vector3f>& points,
                  const Eigen::Isometry3d& T_earlier_points) {
  double sum = 0.0;
  for (const Eigen::Vector3f& point : points)
    sum += earlier.distance(T_earlier_points * point.cast<double>());
  return sum / static_cast<double>(points.size());
}

const char* nameOf(PosesIn sensor) {
  return sensor == PosesIn::kCamera ? "camera" : "lidar";
}

std::vector<Eigen::Vector3f> someOf(const std::vector<Eigen::Vector3f>& points) {
  std::vector<Eigen::Vector3f> some;
  const std::size_t step = points.size() / kPoints + 1;
  for (std::size_t i = 0; i < points.size(); i += step) {
    if (isUsed(points[i])) some.push_back(points[i]);
  }
  return some;
}

}  // namespace

std::optional<PoseAgreement> comparePoses(const Sequence& given, const Sequence& other, std::size_t first,
                                          std::size_t last) {
  PoseAgreement agreement;
  std::size_t compared = 0;
  for (const Pair& pair : choosePairs(given, other, first, last)) {
    const Cells earlier(given.read(pair.from).points);
    const std::vector<Eigen::Vector3f> points = someOf(given.read(pair.to).points);
    if (points.empty()) continue;
    agreement.as_given += distanceTo(earlier, points, between(given, pair.from, pair.to));
    agreement.otherwise += distanceTo(earlier, points, between(other, pair.from, pair.to));
    ++compared;
  }
  if (compared == 0) return std::nullopt;
  agreement.as_given /= static_cast<double>(compared);
  agreement.otherwise /= static_cast<double>(compared);
  return agreement;
}

std::string poseWarning(const std::string& folder, SequenceOptions options, std::size_t first,
                        std::size_t last) {
  if (options.poses_in) return "";
  options.labels.clear();
  const Sequence as_given(folder, options);
  if (as_given.layout() != SequenceLayout::kSemanticKitti) return "";
  const bool of_camera = as_given.posesIn() == PosesIn::kCamera;
  if (!of_camera && !std::filesystem::exists(std::filesystem::path(folder) / "calib.txt")) return "";
  options.poses_in = of_camera ? PosesIn::kLidar : PosesIn::kCamera;
  std::optional<PoseAgreement> agreement;
  try {
    agreement = comparePoses(as_given, Sequence(folder, options), first, last);
  } catch (const std::runtime_error&) {  // the other reading is impossible, or a scan has a fault
    return "";
  }
  if (!agreement || !agreement->otherIsBetter()) return "";
  const auto centimetres = [](double metres) { return numberText(std::round(100.0 * metres)) + " cm"; };
  return std::string("the poses seem to be those of the ") + nameOf(*options.poses_in) +
         ": points of following scans are " + centimetres(agreement->as_given) + " apart as poses of the " +
         nameOf(as_given.posesIn()) + ", but " + centimetres(agreement->otherwise) + " as poses of the " +
         nameOf(*options.poses_in) +
         "; say which they are of with --poses-in camera or --poses-in lidar (poses_in in Python and "
         "city.yaml)";
}

}  // namespace bki_mapping
