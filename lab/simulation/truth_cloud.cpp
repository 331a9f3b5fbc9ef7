#include "simulation/truth_cloud.h"

#include <cmath>
#include <stdexcept>

#include "bki_mapping/core/named_parameter.h"
#include "core/float_origin.h"
#include "sequence/pcd_file.h"
#include "simulation/weather.h"

namespace bki_mapping {
namespace {

// Of the benchmark's converter for SemanticKITTI.
constexpr std::uint32_t kUnlabelled = 0, kOutlier = 1;
constexpr float kMostRange = 50.0f, kOwnCar = 3.0f;

}  // namespace

KittiLabels KittiLabels::moving() {
  return {252, 253, 254, 255, 256, 257, 258, 259};
}

void TruthCloud::setOrigin(const Eigen::Vector3d& near) {
  if (!fixed_origin) fixed_origin = floatOrigin(near, kFineVoxel);
}

Eigen::Vector3f TruthCloud::relative(const Scan& scan, std::size_t i) const {
  return (scan.origin + scan.points[i].cast<double>() - origin()).cast<float>();
}

void TruthCloud::add(const Scan& scan) {
  static const KittiLabels moves = KittiLabels::moving(), without_class{kUnlabelled, kOutlier};
  setOrigin(scan.origin);
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const float range = scan.points[i].norm();
    if (!std::isfinite(range)) ++not_finite;
    if (!(range < kMostRange)) continue;
    const std::uint32_t label = scan.labels[i];
    if (simulation::isNothing(label)) continue;
    const bool own_car = range < kOwnCar && without_class.contains(label);
    points.push_back(relative(scan, i));
    moving.push_back(own_car || moves.contains(label));
  }
}

TruthCloud readTruthCloud(const std::string& path) {
  const PcdPoints file = readPcdPoints(path);
  const std::vector<double>& values = file.label.empty() ? file.intensity : file.label;
  const std::string name = file.label.empty() ? "intensity" : "label";
  if (values.size() != file.points.size()) {
    throw std::runtime_error(path +
                             " has neither a field label nor a field intensity; one of them must be 1 "
                             "for points of moving objects, and 0 for others");
  }
  TruthCloud cloud;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (values[i] != 0.0 && values[i] != 1.0) {
      throw std::runtime_error(path + ": point " + std::to_string(i) + " has " + name + " " +
                               numberText(values[i]) + ", but must have 1 (moving) or 0");
    }
    if (!file.points[i].allFinite()) {
      ++cloud.not_finite;
      continue;
    }
    cloud.setOrigin(file.points[i]);
    cloud.points.push_back((file.points[i] - cloud.origin()).cast<float>());
    cloud.moving.push_back(values[i] == 1.0);
  }
  return cloud;
}

void writeTruthCloud(const std::string& path, const TruthCloud& cloud) {
  writePcdPoints(path, cloud.points, cloud.origin(), {cloud.moving.begin(), cloud.moving.end()},
                 Eigen::Isometry3d::Identity());
}

}  // namespace bki_mapping
