#include "evaluation/trace_evaluation.h"

namespace bki_mapping {

std::uint32_t TraceEvaluation::voxelAt(const Eigen::Vector3d& point) {
  const VoxelIndex index = geometry_.voxelAt(point);
  const auto fresh = static_cast<std::uint32_t>(voxels_.size());
  const std::uint32_t n = index_of_.insert(index, fresh);
  if (n == fresh) voxels_.push_back({index});
  return n;
}

void TraceEvaluation::add(const Scan& scan, Occupants& map) {
  last_time_ = 1e-9 * static_cast<double>(scan.stamp);
  all_points_ += scan.points.size();
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const Eigen::Vector3d point = scan.origin + scan.points[i].cast<double>();
    if (!geometry_.contains(point)) continue;
    const std::uint32_t n = voxelAt(point);
    if (is_trace_(scan.labels[i])) {
      points_.push_back({n, last_time_, static_cast<double>(scan.points[i].norm())});
    } else if (!is_nothing_(scan.labels[i])) {
      voxels_[n].is_shared = true;
    }
  }
  constexpr double kRounding = 1e-6;  // of times [s]
  for (std::size_t age = 0; age < followed_.size(); ++age) {
    for (std::size_t& n = followed_[age]; n < points_.size(); ++n) {
      Point& point = points_[n];
      if (last_time_ < point.time + TraceQuality::kAges[age] - kRounding) break;
      point.left[age] = map.at(voxels_[point.voxel].index).has_value();
    }
  }
}

TraceQuality TraceEvaluation::quality(Occupants& map) const {
  TraceQuality quality;
  quality.points = points_.size();
  quality.all_points = all_points_;
  for (std::size_t n = 0; n < points_.size(); ++n) {
    const Point& point = points_[n];
    const Voxel& voxel = voxels_[point.voxel];
    if (voxel.is_shared) continue;
    const bool left = map.at(voxel.index).has_value();
    for (std::size_t bin = 0; bin < TraceQuality::kDistances.size(); ++bin) {
      if (point.distance > TraceQuality::kDistances[bin]) continue;
      TraceQuality::UpTo& traces = quality.up_to[bin];
      for (std::size_t age = 0; age < followed_.size(); ++age) {
        if (n >= followed_[age]) continue;
        ++traces.after[age].points;
        traces.after[age].left += point.left[age];
      }
      if (n >= followed_[0]) continue;
      ++traces.at_end.points;
      traces.at_end.left += left;
    }
  }
  return quality;
}

void removeNothing(TraceEvaluation::Has is_nothing, Scan& scan, std::vector<std::uint32_t>& predicted) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    if (is_nothing(scan.labels[i])) continue;
    scan.points[kept] = scan.points[i];
    scan.labels[kept] = scan.labels[i];
    predicted[kept++] = predicted[i];
  }
  scan.points.resize(kept);
  scan.labels.resize(kept);
  predicted.resize(kept);
}

}  // namespace bki_mapping
