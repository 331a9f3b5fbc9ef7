#include "evaluation/cloud_evaluation.h"

#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>

#include "bki_mapping/rules/voxel_state.h"
#include "parallel/thread_pool.h"

namespace bki_mapping {
namespace {

constexpr std::uint32_t kUnlabelled = 0, kMovingCar = 252;  // of SemanticKITTI

}  // namespace

struct NearestPoints::Tree {
  pcl::KdTreeFLANN<pcl::PointXYZ> points;
};

NearestPoints::NearestPoints(const std::vector<Eigen::Vector3f>& points) {
  if (points.empty()) return;  // PCL wants one at least
  const auto cloud = std::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  cloud->reserve(points.size());
  for (const Eigen::Vector3f& point : points) cloud->emplace_back(point.x(), point.y(), point.z());
  tree_ = std::make_unique<Tree>();
  tree_->points.setInputCloud(cloud);
}

NearestPoints::~NearestPoints() = default;
NearestPoints::NearestPoints(NearestPoints&&) noexcept = default;

std::optional<std::size_t> NearestPoints::find(const Eigen::Vector3f& point, float distance) const {
  if (!tree_ || !point.allFinite()) return std::nullopt;
  std::vector<int> index(1);
  std::vector<float> squared(1);
  if (tree_->points.nearestKSearch({point.x(), point.y(), point.z()}, 1, index, squared) == 0)
    return std::nullopt;
  if (std::sqrt(squared[0]) > distance) return std::nullopt;
  return static_cast<std::size_t>(index[0]);
}

CloudQuality compareClouds(const TruthCloud& truth, const std::vector<Eigen::Vector3f>& cleaned,
                           double distance) {
  const NearestPoints nearest(cleaned);
  std::vector<std::uint8_t> kept(truth.points.size());
  ThreadPool pool(0);
  constexpr std::size_t kChunk = 4096;  // points
  pool.forEach((kept.size() + kChunk - 1) / kChunk, [&](std::size_t chunk, std::size_t) {
    const std::size_t end = std::min(kept.size(), (chunk + 1) * kChunk);
    for (std::size_t i = chunk * kChunk; i < end; ++i)
      kept[i] = nearest.find(truth.points[i], static_cast<float>(distance)).has_value();
  });
  CloudQuality quality;
  quality.distance = distance;
  quality.cleaned_points = cleaned.size();
  quality.not_finite = truth.not_finite;
  for (std::size_t i = 0; i < kept.size(); ++i) {
    (truth.moving[i] ? quality.moving_points : quality.static_points) += 1;
    quality.moving_removed += truth.moving[i] && !kept[i];
    quality.static_kept += !truth.moving[i] && kept[i];
  }
  return quality;
}

CloudEvaluation::CloudEvaluation(std::optional<TruthCloud> truth, double distance) : distance_(distance) {
  if (!truth) return;
  truth_ = std::move(*truth);
  nearest_in_truth_.emplace(truth_.points);
}

void CloudEvaluation::add(const Scan& scan) {
  if (!nearest_in_truth_) truth_.add(scan);
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    if (scan.points[i].allFinite()) points_.push_back(truth_.relative(scan, i));
  }
}

Scan CloudEvaluation::labelled(const Scan& scan) const {
  Scan known = scan;
  known.points.clear();
  known.labels.clear();
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const auto same = nearest_in_truth_->find(truth_.relative(scan, i), static_cast<float>(distance_));
    if (!same) continue;
    known.points.push_back(scan.points[i]);
    known.labels.push_back(truth_.moving[*same] ? kMovingCar : kUnlabelled);
  }
  return known;
}

CloudQuality CloudEvaluation::compare(const SemanticMap& map, const StateRules& rules) const {
  std::vector<Eigen::Vector3f> cleaned;
  for (const Eigen::Vector3f& point : points_) {
    const Eigen::Vector3d at = truth_.origin() + point.cast<double>();
    if (!map.geometry().contains(at)) continue;
    const VoxelView view = viewWithoutEntropy(map, rules, map.geometry().voxelAt(at));
    if (view.state == VoxelState::kOccupied) cleaned.push_back(point);
  }
  return compareClouds(truth_, cleaned, distance_);
}

}  // namespace bki_mapping
