#include "evaluation/semantic_evaluation.h"

#include <algorithm>
#include <limits>
#include <set>

namespace bki_mapping {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// A voxel in the order of removal: its rank, its points, and how many of them are wrong.
struct Ranked {
  double rank;
  std::size_t points, wrong;
};

/// Error rate among the remaining points, averaged over all fractions removed from the front.
double meanErrorLeft(const std::vector<Ranked>& voxels, double points, double wrong) {
  double area = 0.0, left = points;
  for (const Ranked& voxel : voxels) {
    if (left <= 0.0) break;
    area += wrong / left * static_cast<double>(voxel.points) / points;
    left -= static_cast<double>(voxel.points);
    wrong -= static_cast<double>(voxel.wrong);
  }
  return area;
}

double sparsificationError(std::vector<Ranked> voxels) {
  double points = 0.0, wrong = 0.0;
  for (const Ranked& voxel : voxels) {
    points += static_cast<double>(voxel.points);
    wrong += static_cast<double>(voxel.wrong);
  }
  if (points == 0.0) return kNan;
  const auto byRank = [](const Ranked& a, const Ranked& b) { return a.rank > b.rank; };
  std::stable_sort(voxels.begin(), voxels.end(), byRank);
  const double by_variance = meanErrorLeft(voxels, points, wrong);
  for (Ranked& voxel : voxels)
    voxel.rank = static_cast<double>(voxel.wrong) / static_cast<double>(voxel.points);
  std::stable_sort(voxels.begin(), voxels.end(), byRank);
  return by_variance - meanErrorLeft(voxels, points, wrong);
}

}  // namespace

std::size_t Confusion::count(ClassId truth, ClassId predicted) const {
  const auto found = counts_.find({truth, predicted});
  return found == counts_.end() ? 0 : found->second;
}

std::size_t Confusion::points(ClassId truth) const {
  std::size_t sum = 0;
  for (const auto& [pair, count] : counts_) sum += pair.first == truth ? count : 0;
  return sum;
}

double Confusion::iou(ClassId id) const {
  std::size_t either = 0;
  for (const auto& [pair, count] : counts_) either += pair.first == id || pair.second == id ? count : 0;
  return either == 0 ? kNan : static_cast<double>(count(id, id)) / static_cast<double>(either);
}

double Confusion::meanIou() const {
  std::set<ClassId> true_classes;
  for (const auto& [pair, count] : counts_) {
    if (count > 0) true_classes.insert(pair.first);
  }
  double sum = 0.0;
  for (const ClassId id : true_classes) sum += iou(id);
  return sum / static_cast<double>(true_classes.size());
}

double Confusion::accuracy() const {
  std::size_t right = 0, all = 0;
  for (const auto& [pair, count] : counts_) {
    all += count;
    right += pair.first == pair.second ? count : 0;
  }
  return all == 0 ? kNan : static_cast<double>(right) / static_cast<double>(all);
}

void SemanticEvaluation::add(const Scan& scan, const std::vector<std::uint32_t>& predicted,
                             const ClassTable& classes) {
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const Eigen::Vector3d point = scan.origin + scan.points[i].cast<double>();
    const auto truth = classes.classOf(scan.labels[i], labelValues(scan));
    if (!truth || truth == classes.unlabelled() || !geometry_.contains(point)) continue;
    const ClassId given = classes.classOf(predicted[i], labelValues(scan)).value_or(kFreeClass);
    const bool moving = !scan.labels_are_ids && moving_.contains(scan.labels[i]);
    const VoxelIndex index = geometry_.voxelAt(point);
    const auto fresh = static_cast<std::uint32_t>(voxels_.size());
    const std::uint32_t n = index_of_.insert(index, fresh);
    if (n == fresh) {
      voxels_.push_back(index);
      points_.emplace_back();
    }
    const auto alike = [&](const Points& p) {
      return p.truth == *truth && p.predicted == given && p.moving == moving;
    };
    const auto known = std::find_if(points_[n].begin(), points_[n].end(), alike);
    if (known == points_[n].end()) {
      points_[n].push_back({*truth, given, moving, 1});
    } else {
      ++known->count;
    }
  }
}

SemanticQuality SemanticEvaluation::compare(const SemanticMap& map, const StateRules& rules,
                                            const StillThere& still_there) const {
  SemanticQuality quality;
  std::vector<Ranked> ranked;
  for (std::size_t n = 0; n < voxels_.size(); ++n) {
    const VoxelView view = viewWithoutEntropy(map, rules, voxels_[n]);
    const bool occupied = view.state == VoxelState::kOccupied;
    const bool has_left = still_there && !still_there(voxels_[n]);
    Ranked voxel{static_cast<double>(view.variance), 0, 0};
    for (const Points& p : points_[n]) {
      quality.map.add(p.truth, view.label, p.count);
      quality.input.add(p.truth, p.predicted, p.count);
      voxel.points += p.count;
      voxel.wrong += p.truth == view.label ? 0 : p.count;
      if (p.moving && has_left) continue;
      quality.map_of_present.add(p.truth, view.label, p.count);
      quality.input_of_present.add(p.truth, p.predicted, p.count);
      if (!occupied) continue;
      quality.map_of_occupied.add(p.truth, view.label, p.count);
      quality.input_of_occupied.add(p.truth, p.predicted, p.count);
    }
    if (!occupied) continue;
    ranked.push_back(voxel);
    const std::size_t right = voxel.points - voxel.wrong;
    quality.probability.add(static_cast<double>(view.probability), voxel.points, right);
    quality.class_probability.add(static_cast<double>(view.class_probability), voxel.points, right);
  }
  quality.sparsification_error = sparsificationError(std::move(ranked));
  return quality;
}

std::vector<VoxelIndex> SemanticEvaluation::wrongVoxels(const SemanticMap& map,
                                                        const StateRules& rules) const {
  std::vector<VoxelIndex> wrong;
  for (std::size_t n = 0; n < voxels_.size(); ++n) {
    const VoxelView view = viewWithoutEntropy(map, rules, voxels_[n]);
    const auto is_right = [&](const Points& p) { return p.truth == view.label; };
    const bool right = std::any_of(points_[n].begin(), points_[n].end(), is_right);
    if (view.state == VoxelState::kOccupied && !right) wrong.push_back(voxels_[n]);
  }
  return wrong;
}

}  // namespace bki_mapping
