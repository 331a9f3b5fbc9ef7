#include "evaluation/presence_evaluation.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace bki_mapping {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

}  // namespace

double Delays::quantile(double share) const {
  if (count() == 0) return std::numeric_limits<double>::quiet_NaN();
  std::vector<double> sorted = seconds;
  std::sort(sorted.begin(), sorted.end());
  const auto n = static_cast<std::size_t>(std::ceil(share * static_cast<double>(count())));
  return n <= sorted.size() ? sorted[std::max<std::size_t>(n, 1) - 1] : kNever;
}

std::uint32_t PresenceEvaluation::voxelAt(const VoxelIndex& index) {
  const auto fresh = static_cast<std::uint32_t>(voxels_.size());
  const std::uint32_t n = index_of_.insert(index, fresh);
  if (n == fresh) {
    voxels_.push_back({index});
    voxels_.back().last_hit = -kNever;
  }
  return n;
}

void PresenceEvaluation::start(std::uint32_t n, Wait wait, double time) {
  Voxel& voxel = voxels_[n];
  voxel.wait = wait;
  voxel.since = time;
  if (!voxel.waits) waiting_.push_back(n);
  voxel.waits = true;
}

void PresenceEvaluation::follow(const Scan& scan, double time, Occupants& map) {
  beams_.build(scan);
  const auto isDone = [&](std::uint32_t n) {
    Voxel& voxel = voxels_[n];
    const bool is_hit = voxel.last_hit == time;
    if (voxel.wait == Wait::kToAppear) {
      if (map.at(voxel.index)) {
        delays_.push_back({n, true, time - voxel.since});
        voxel.wait = Wait::kToBeSeen;
      } else if (time - voxel.last_hit > kAnew) {
        delays_.push_back({n, true, kNever});
        voxel.wait = Wait::kNone;
      }
    } else if (is_hit) {
      voxel.wait = Wait::kToBeSeen;
    }
    const bool is_taken = voxel.wait != Wait::kNone && isTaken(voxel, time);
    if (is_taken && voxel.wait == Wait::kToClear) voxel.wait = Wait::kToBeSeen;
    if (is_taken && voxel.wait == Wait::kToBeSeen && !map.at(voxel.index)) voxel.wait = Wait::kNone;
    if (voxel.wait == Wait::kToBeSeen && !is_hit && !is_taken &&
        beams_.anyPasses(geometry_.voxelCentre(voxel.index), geometry_.resolution())) {
      start(n, Wait::kToClear, time);
    }
    if (voxel.wait == Wait::kToClear && !map.at(voxel.index)) {
      delays_.push_back({n, false, time - voxel.since});
      voxel.wait = Wait::kNone;
    }
    voxel.waits = voxel.wait != Wait::kNone;
    return !voxel.waits;
  };
  waiting_.erase(std::remove_if(waiting_.begin(), waiting_.end(), isDone), waiting_.end());
}

void PresenceEvaluation::add(const Scan& scan, const ClassTable& classes, Occupants& map) {
  const double time = 1e-9 * static_cast<double>(scan.stamp);
  struct Hit {
    std::size_t point;
    std::uint32_t voxel;
    ClassId id;
  };
  std::vector<Hit> hits;
  std::vector<std::pair<std::uint32_t, ClassId>> classes_hit;  // in each voxel
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const Eigen::Vector3d point = scan.origin + scan.points[i].cast<double>();
    const auto id = classes.classOf(scan.labels[i], labelValues(scan));
    if (!id || id == classes.unlabelled() || !geometry_.contains(point)) continue;
    hits.push_back({i, voxelAt(geometry_.voxelAt(point)), *id});
    const std::pair<std::uint32_t, ClassId> hit(hits.back().voxel, *id);
    if (classes_hit.empty() || classes_hit.back() != hit) classes_hit.push_back(hit);
  }
  std::sort(classes_hit.begin(), classes_hit.end());
  for (const auto& [i, n, id] : hits) {
    const bool moves = !scan.labels_are_ids && moving_.contains(scan.labels[i]);
    Voxel& voxel = voxels_[n];
    const double before = voxel.last_hit;
    voxel.last_hit = time;
    voxel.is_shared |= !moves;
    if (scans_ < kFirstScans) continue;
    if (moves && before != time && time - before > kAnew) {
      voxel.came = true;
      start(n, Wait::kToAppear, time);
    }
    if (!moves && !classes.find(id)->dynamic) continue;
    const std::optional<ClassId> shown = map.at(voxel.index);
    for (std::size_t bin = 0; bin < PresenceQuality::kDistances.size(); ++bin) {
      if (static_cast<double>(scan.points[i].norm()) > PresenceQuality::kDistances[bin]) continue;
      PresentPoints& points = (moves ? quality_.moving : quality_.standing)[bin];
      ++points.points;
      points.present += shown.has_value();
      points.named +=
          shown && std::binary_search(classes_hit.begin(), classes_hit.end(), std::pair(n, *shown));
    }
  }
  follow(scan, time, map);
  last_time_ = time;
  ++scans_;
}

bool PresenceEvaluation::stays(const Voxel& voxel) const {
  for (double time = last_time_; time > voxel.last_hit; time -= 0.5) {
    if (!isTaken(voxel, time)) return false;
  }
  return isTaken(voxel, voxel.last_hit);
}

PresenceQuality PresenceEvaluation::quality(Occupants& map) const {
  PresenceQuality quality = quality_;
  for (const Delay& delay : delays_) {
    if (voxels_[delay.voxel].is_shared) continue;
    Delays& all = delay.appears ? quality.appear : quality.clear;
    if (delay.seconds < kNever) {
      all.seconds.push_back(delay.seconds);
    } else {
      ++all.never;
    }
  }
  for (const Voxel& voxel : voxels_) {
    if (!voxel.came || voxel.is_shared || !stays(voxel)) continue;
    ++quality.stayed;
    quality.stayed_present += map.at(voxel.index).has_value();
  }
  // What is not cleared by the end, although beams have been near for as long as clearing may take.
  for (const std::uint32_t n : waiting_) {
    const Voxel& voxel = voxels_[n];
    if (voxel.wait == Wait::kToClear && !voxel.is_shared && last_time_ - voxel.since > kAnew)
      ++quality.clear.never;
  }
  return quality;
}

}  // namespace bki_mapping
