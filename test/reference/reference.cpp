#include "reference/reference.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "parallel/counter_random.h"
#include "points/isolated_points.h"

namespace bki_mapping::reference {
namespace {

constexpr double kPi = 3.14159265358979323846;
/// Comparisons closer than this are undecided: single precision may round either way.
constexpr double kClose = 2e-5;

}  // namespace

double sparseKernel(double d, double length, double scale) {
  const double r = d / length;
  if (r >= 1.0) return 0.0;
  return scale * ((2.0 + std::cos(2.0 * kPi * r)) / 3.0 * (1.0 - r) + std::sin(2.0 * kPi * r) / (2.0 * kPi));
}

/// The integral of k(d) of unit length and scale over space, by the midpoint rule.
double kernelIntegral() {
  constexpr int kSteps = 10000;
  double sum = 0.0;
  for (int n = 0; n < kSteps; ++n) {
    const double r = (n + 0.5) / kSteps;
    sum += 4.0 * kPi * r * r * sparseKernel(r, 1.0, 1.0) / kSteps;
  }
  return sum;
}

std::vector<Point> downsample(const Eigen::Vector3d& origin, const std::vector<Point>& points, double cell) {
  if (cell == 0.0) return points;
  using Key = std::tuple<int, int, int>;
  std::map<Key, std::vector<Point>> cells;
  std::vector<Key> order;
  for (const Point& point : points) {
    const Eigen::Vector3d g = (origin + point.p) / cell;
    const Key key(static_cast<int>(std::floor(g.x())), static_cast<int>(std::floor(g.y())),
                  static_cast<int>(std::floor(g.z())));
    if (cells[key].empty()) order.push_back(key);
    cells[key].push_back(point);
  }
  std::vector<Point> result;
  for (const Key& key : order) {
    Point merged{Eigen::Vector3d::Zero(), 0};
    std::map<int, int> votes;
    for (const Point& point : cells[key]) {
      merged.p += point.p / static_cast<double>(cells[key].size());
      ++votes[point.label];
    }
    int most = 0;
    for (const auto& [label, count] : votes) {
      if (count > most) {
        most = count;
        merged.label = label;
      }
    }
    const int votes_for_label = most;
    for (const Point& point : cells[key]) {
      if (point.label != merged.label) continue;
      for (const auto& [label, share] : point.shares) merged.shares[label] += share / votes_for_label;
    }
    result.push_back(merged);
  }
  return result;
}

namespace {

/// Where a direction is: its row and column of cells, the half of its cell, and how many columns the row has.
struct Direction {
  int row, column, half, columns;
};

Direction directionOf(const DirectionCells& cells, const Eigen::Vector3f& point) {
  const auto [of_point, half] = cells.placeOf(point, point.norm());
  const auto cell = static_cast<int>(of_point);
  int begin = 0;
  for (int row = 0;; ++row) {
    const double z = (row + 0.5) / 58.0 - 1.0;
    const int columns = std::max(static_cast<int>(std::round(kPi * 116.0 * std::sqrt(1.0 - z * z))), 1);
    if (cell < begin + columns) return {row, cell - begin, half, columns};
    begin += columns;
  }
}

/// How far a place is from where a part of another row is, if both rows are parts of a circle. @param at, of
/// of so many parts. @param to, parts the same of the other row.
int partsBetween(int at, int of, int to, int parts) {
  const int apart = std::abs(to - (2 * at + 1) * parts / (2 * of));
  return std::min(apart, parts - apart);
}

}  // namespace

std::vector<bool> isolatedPoints(const std::vector<Eigen::Vector3f>& points, double within) {
  const DirectionCells cells;
  const auto isBeam = [&](std::size_t i) { return points[i].norm() >= 1e-3f && points[i].norm() < 1e6f; };
  std::vector<Direction> directions(points.size());
  std::vector<int> slices(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!isBeam(i)) continue;
    directions[i] = directionOf(cells, points[i]);
    slices[i] = IsolatedPoints::sliceOf(points[i].norm());
  }
  std::vector<bool> isolated(points.size(), false);
  for (int pass = 0; pass < 2; ++pass) {
    const std::vector<bool> before = isolated;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!isBeam(i) || slices[i] >= IsolatedPoints::sliceOf(static_cast<float>(within))) continue;
      int ends = 0, found = 0, together = 0, elsewhere = 0;                            // about its range
      int beams = 0, around = 0, near = 0, in_row[2] = {0, 0}, in_column[2] = {0, 0};  // all, near
      for (std::size_t j = 0; j < points.size(); ++j) {
        if (j == i || !isBeam(j)) continue;
        const Direction &here = directions[i], &there = directions[j];
        const int aside = partsBetween(here.column, here.columns, there.column, there.columns);
        const int halves = partsBetween(2 * here.column + here.half, 2 * here.columns,
                                        2 * there.column + there.half, 2 * there.columns);
        const bool whole = there.columns <= 5;
        if (std::abs(there.row - here.row) > 2 || (aside > 2 && !whole)) continue;
        const bool counts = std::abs(slices[j] - slices[i]) <= 1 && !before[j];
        ++beams;
        const int deeper = slices[j] - slices[i];
        if (deeper >= -40 && deeper <= 2) ++ends, found += before[j];
        if (std::abs(deeper) <= 1) ++together;
        if (std::abs(deeper) > 2 && deeper >= -40 && deeper <= 20) elsewhere += before[j];
        if (slices[j] < slices[i] - 2) continue;
        ++around;
        near += counts;
        if (there.row == here.row) ++in_row[0], in_row[1] += counts;
        if (halves <= 1) ++in_column[0], in_column[1] += counts;
      }
      if (before[i]) ++found;
      ++ends;
      double strictness = 1.0;
      if (pass == 1 && static_cast<float>(found) < 0.15f * static_cast<float>(ends)) strictness = 0.0;
      if (pass == 1 && static_cast<float>(found) > 0.3f * static_cast<float>(ends)) strictness = 3.0;
      const float by_chance = 3.0f * static_cast<float>(elsewhere) / 56.0f;
      if (pass == 1 && static_cast<float>(together) >= 4.0f + 6.0f * by_chance) strictness = 0.0;
      const auto isLine = [strictness](const int(&strip)[2]) {
        return strip[1] >= strictness * std::max(0.15f * static_cast<float>(strip[0]), 3.0f);
      };
      isolated[i] = strictness > 0.0 &&
                    (before[i] || (beams >= 3 && near < strictness * std::max(std::sqrt(around), 1.0) &&
                                   !isLine(in_row) && !isLine(in_column)));
    }
  }
  return isolated;
}

ScanReference::ScanReference(const Scan& scan, const ClassTable& classes, const MapperConfig& config)
    : config_(applied(config)),
      geometry_(config.resolution),
      origin_(scan.origin),
      classes_(classes.classes()) {
  const SensorModelConfig sensor = scan.sensor_model.value_or(config.sensor_model);
  const double max_range = sensor.max_range;
  std::vector<Point> raw, cut;
  const bool seeks = config.rules.enabled && config.rules.particles_within > 0.0;
  const std::vector<bool> isolated = seeks ? isolatedPoints(scan.points, config.rules.particles_within)
                                           : std::vector<bool>(scan.points.size(), false);
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const Eigen::Vector3d p = scan.points[i].cast<double>();
    const double range = p.norm();
    if (!p.allFinite() || range < 1e-3 || range < sensor.min_range) continue;
    const double beyond = range / max_range - 1.0;
    if (max_range > 0.0 && scan.no_returns_at_max_range && std::abs(beyond) <= 1e-4) {
      cut.push_back({p * (max_range / range), 255});
      continue;
    }
    if (range > sensor.reach()) {
      if (max_range > 0.0 && config.clear_beyond_max_range) cut.push_back({p * (max_range / range), 255});
      continue;
    }
    const LabelValues values = scan.labels_are_ids ? LabelValues::kId : config.label_values;
    auto id = classes.classOf(scan.labels[i], values);
    if (!id && config.unknown_labels == UnknownLabels::kUnlabelled) id = classes.unlabelled();
    if (!id || (id == classes.unlabelled() && config.unlabelled_points == UnlabelledPoints::kIgnore))
      continue;
    const SemanticClass& known = *classes.find(*id);
    if (known.airborne || (isolated[i] && !known.ground)) {
      cut.push_back({p, 255});
      continue;
    }
    raw.push_back({p, *id});
    if (scan.soft.empty()) continue;
    for (const ClassShare* s = scan.soft.begin(i); s != scan.soft.end(i); ++s) {
      raw.back().shares[s->id] = s->share;
    }
    if (raw.back().shares.empty()) raw.back().shares[*id] = 1.0;
  }
  for (const Eigen::Vector3f& direction : scan.no_returns) {
    cut.push_back({direction.cast<double>().normalized() * max_range, 255});
  }
  hits_ = downsample(origin_, raw, config_.downsample_resolution);
  if (config.rules.enabled) setThreshold(sensor.height);
  for (const Point& hit : hits_) beams_.push_back(hit.p);
  for (const Point& end : downsample(origin_, cut, config_.downsample_resolution)) beams_.push_back(end.p);
  drawSamples(scan.stamp);
}

void ScanReference::setThreshold(double height) {
  for (const double far : {10.0, 20.0}) {
    if (height > 0.0) break;
    std::vector<double> heights;
    for (const Point& hit : hits_) {
      for (const SemanticClass& c : classes_) {
        const bool is_ground = c.ground && hit.shareOf(c.id) > 0.0;
        if (is_ground && hit.p.head<2>().norm() <= far) heights.push_back(-hit.p.z());
      }
    }
    if (heights.size() < 20) continue;
    std::sort(heights.begin(), heights.end(), std::greater<>());
    height = heights[heights.size() / 2];
    break;
  }
  if (!(height > 0.0)) return;
  config_.scan_rules.free_threshold = static_cast<float>(
      0.166 * config_.kernel.scale * config_.kernel.lengthFor(config_.resolution) / height);
}

void ScanReference::drawSamples(std::uint64_t stamp) {
  const FreeSpaceConfig& c = config_.free_space;
  std::vector<Point> all;
  for (std::size_t b = 0; b < beams_.size(); ++b) {
    const double length = beams_[b].norm();
    const auto sample = [&](double distance) { all.push_back({beams_[b] / length * distance, 255}); };
    if (c.mode == "even") {
      for (int n = 1; n * c.gap < length; ++n) sample(n * c.gap);
    } else if (c.mode == "uniform" || c.mode == "linear") {
      for (int n = 0; n < c.samples_per_beam; ++n) {
        const double u =
            counterRandom(static_cast<std::uint64_t>(c.seed), stamp, b, static_cast<std::uint64_t>(n));
        sample(length * (c.mode == "linear" ? std::sqrt(u) : u));
      }
    }
  }
  samples_ = downsample(origin_, all, config_.downsample_resolution);
}

Eigen::Vector3d ScanReference::relativeCentre(const VoxelIndex& voxel) const {
  return Eigen::Vector3d(voxel.x + 0.5, voxel.y + 0.5, voxel.z + 0.5) * config_.resolution - origin_;
}

Value ScanReference::pointEvidence(const std::vector<Point>& points, const VoxelIndex& voxel,
                                   int label) const {
  const Eigen::Vector3d centre = relativeCentre(voxel);
  const double length = config_.kernel.lengthFor(config_.resolution);
  Value value;
  for (const Point& point : points) {
    const double share = point.shareOf(label);
    const Eigen::Vector3d from_centre = point.p - centre;
    if (share == 0.0 || from_centre.cwiseAbs().maxCoeff() >= std::max(length, config_.resolution)) continue;
    if (config_.kernel.type == KernelType::kSparse) {
      value.sum += share * sparseKernel(from_centre.norm(), length, config_.kernel.scale);
      continue;
    }
    // The voxel holds the point if the offset from its centre is in [-half, half) on each axis.
    const Eigen::Array3d offset = from_centre.array() / config_.resolution;
    const double outside = offset.abs().maxCoeff() - 0.5;
    if (outside < -kClose) value.sum += share;
    if (std::abs(outside) <= kClose) value.slack += share;
  }
  return value;
}

bool ScanReference::spreads(const SemanticClass& c) const {
  if (config_.kernel.type == KernelType::kCounting) return false;
  return config_.scan_rules.static_spread || c.dynamic || c.unlabelled;
}

Value ScanReference::hitEvidence(const VoxelIndex& voxel, const SemanticClass& c) const {
  if (spreads(c) || config_.kernel.type == KernelType::kCounting) return pointEvidence(hits_, voxel, c.id);
  const double in_voxels = config_.kernel.lengthFor(config_.resolution) / config_.resolution;
  static const double kIntegral = kernelIntegral();
  const double total = config_.kernel.scale * kIntegral * in_voxels * in_voxels * in_voxels;
  const Eigen::Vector3d centre = relativeCentre(voxel);
  Value value;
  for (const Point& hit : hits_) {
    const double share = hit.shareOf(c.id);
    if (share == 0.0) continue;
    const double outside = ((hit.p - centre) / config_.resolution).cwiseAbs().maxCoeff() - 0.5;
    if (outside < -kClose) value.sum += share * total;
    if (std::abs(outside) <= kClose) value.slack += share * total;
  }
  return value;
}

Value ScanReference::anyHit(const VoxelIndex& voxel) const {
  Value all;
  for (const SemanticClass& c : classes_) {
    const Value hits = hitEvidence(voxel, c);
    all.sum += hits.sum;
    all.slack += hits.slack;
  }
  return all;
}

bool ScanReference::reaches(const Eigen::Vector3d& beam, const Eigen::Vector3d& centre, double& rho,
                            double& k) const {
  const double length = beam.norm();
  const Eigen::Vector3d u = beam / length;
  rho = centre.dot(u) / length;
  if (config_.kernel.type == KernelType::kSparse) {
    const double d = (centre - centre.dot(u) * u).norm();
    k = sparseKernel(d, config_.kernel.lengthFor(config_.resolution), config_.kernel.scale);
    return d < config_.kernel.lengthFor(config_.resolution);
  }
  // The half-line crosses the cube if some piece of it is inside all three slabs.
  double enter = 0.0, leave = 1e300;
  for (int axis = 0; axis < 3; ++axis) {
    const double a = (centre[axis] - config_.resolution / 2) / u[axis];
    const double b = (centre[axis] + config_.resolution / 2) / u[axis];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  k = 1.0;
  return enter <= leave;
}

bool ScanReference::blockIsHit(const BlockIndex& block) const {
  const auto key = std::make_tuple(block.x, block.y, block.z);
  const auto known = hit_blocks_.find(key);
  if (known != hit_blocks_.end()) return known->second;
  bool hit = false;
  const double length = config_.kernel.lengthFor(config_.resolution);
  const Eigen::Vector3d first = relativeCentre(GridGeometry::voxelOf(block, 0)),
                        last = relativeCentre(GridGeometry::voxelOf(block, kBlockVoxels - 1));
  std::vector<Point> about;  // no others are near a voxel of the block, or in it
  for (const Point& point : hits_) {
    const Eigen::Vector3d outside = (first - point.p).cwiseMax(point.p - last);
    if (outside.maxCoeff() <= std::max(length, config_.resolution)) about.push_back(point);
  }
  for (int offset = 0; offset < kBlockVoxels && !hit; ++offset) {
    const Eigen::Vector3d centre = relativeCentre(GridGeometry::voxelOf(block, offset));
    for (const Point& point : about) {
      const Eigen::Vector3d d = point.p - centre;
      const bool inside = d.cwiseAbs().maxCoeff() <= config_.resolution / 2;
      const bool near = d.norm() < length;
      if (!inside && !near) continue;
      for (const SemanticClass& c : classes_) {
        if (point.shareOf(c.id) != 0.0) hit |= spreads(c) ? near : inside;
      }
      // Rules that ask for hits count a block that holds one even if its kernel reaches no voxel centre.
      hit |= config_.scan_rules.asksForHits() && inside;
      if (hit) break;
    }
  }
  return hit_blocks_[key] = hit;
}

Value ScanReference::lineEvidence(const VoxelIndex& voxel) const {
  Value value;
  if (config_.free_space.extent == FreeSpaceExtent::kMapped && !blockIsHit(GridGeometry::blockOf(voxel))) {
    return value;
  }
  const Eigen::Vector3d centre = relativeCentre(voxel);
  for (const Eigen::Vector3d& beam : beams_) {
    double rho = 0.0, k = 0.0;
    if (!reaches(beam, centre, rho, k)) continue;
    ++value.beams;
    const bool close = std::min(std::abs(rho), std::abs(1.0 - rho)) < kClose;
    if (close) value.slack += k;
    if (close || rho <= 0.0 || rho >= 1.0) continue;
    switch (config_.free_space.weight) {
      case BeamWeight::kUniform:
        value.sum += k;
        break;
      case BeamWeight::kLinear:
        value.sum += rho * k;
        break;
      case BeamWeight::kBilinear:
        value.sum += std::min(rho, 1.0 - rho) * k;
        break;
    }
  }
  return value;
}

Value ScanReference::unlimited(const VoxelIndex& voxel, ClassId label) const {
  if (label != kFreeClass) {
    const auto is_asked = [&](const SemanticClass& c) { return c.id == label; };
    return hitEvidence(voxel, *std::find_if(classes_.begin(), classes_.end(), is_asked));
  }
  Value value = config_.free_space.mode == "line" ? lineEvidence(voxel) : pointEvidence(samples_, voxel, 255);
  if (!config_.scan_rules.hits_before_misses) return value;
  const Value hits = anyHit(voxel);
  if (hits.slack > 0.0 || (hits.sum != 0.0 && hits.sum < 1e-6 * config_.kernel.scale))
    value.slack += value.sum;
  if (hits.sum >= 1e-6 * config_.kernel.scale) return Value();
  const Eigen::Vector3d centre = relativeCentre(voxel);
  for (const Point& hit : hits_) {
    const double outside = ((hit.p - centre) / config_.resolution).cwiseAbs().maxCoeff() - 0.5;
    if (outside < -kClose) return Value();
    if (outside <= kClose) value.slack += value.sum;
  }
  return value;
}

ScanReference::Seen ScanReference::seen(const VoxelIndex& voxel) const {
  const auto key = std::make_tuple(voxel.x, voxel.y, voxel.z);
  const auto known = seen_.find(key);
  if (known != seen_.end()) return known->second;
  const double scale = config_.kernel.type == KernelType::kSparse ? config_.kernel.scale : 1.0;
  bool fixed = false, may_move = false, close = false;
  for (const SemanticClass& c : classes_) {
    const Value hits = hitEvidence(voxel, c);
    // At the edge of the kernel, single precision may round to 0.
    close |= hits.slack > 0.0 || (hits.sum != 0.0 && hits.sum < 1e-6 * scale);
    (c.dynamic || c.unlabelled ? may_move : fixed) |= hits.sum > 0.0;
  }
  Answer holds = Answer::kNo;
  for (const Point& hit : hits_) {
    const double outside = ((hit.p - relativeCentre(voxel)) / config_.resolution).cwiseAbs().maxCoeff() - 0.5;
    if (outside <= kClose) holds = std::max(holds, outside < -kClose ? Answer::kYes : Answer::kUndecided);
  }
  const Value free = unlimited(voxel, kFreeClass);
  const double above = free.sum - static_cast<double>(config_.scan_rules.most_free),
               tolerance = free.tolerance(scale);
  Seen result = {Answer::kNo, Answer::kNo, Answer::kNo, holds};
  const bool is_free = above > tolerance;
  if (close || (!fixed && !may_move && std::abs(above) <= tolerance)) {
    result = {Answer::kUndecided, Answer::kUndecided, close ? Answer::kUndecided : Answer::kNo, holds};
  } else if (!fixed && !may_move) {
    if (is_free) result.crossed = Answer::kYes;
  } else {
    result.hit = Answer::kYes;
    if (!may_move || holds == Answer::kNo) result.bounds = Answer::kYes;
    if (may_move && holds == Answer::kUndecided) result.bounds = Answer::kUndecided;
  }
  return seen_[key] = result;
}

ScanReference::Answer ScanReference::isEmpty(const VoxelIndex& voxel) const {
  const Seen own = seen(voxel);
  if (own.crossed == Answer::kYes || own.hit == Answer::kYes) return own.crossed;
  const auto crossed = [&](int step) {
    const VoxelIndex at{{voxel.x, voxel.y, voxel.z + step}};
    return isUpdated(at) ? seen(at).crossed : Answer::kNo;
  };
  const Answer no_hit = own.hit == Answer::kNo ? Answer::kYes : Answer::kUndecided;
  return std::max(own.crossed, std::min({no_hit, crossed(-1), crossed(1)}));
}

bool ScanReference::isUpdated(const VoxelIndex& voxel) const {
  return config_.free_space.extent != FreeSpaceExtent::kMapped || config_.free_space.mode != "line" ||
         blockIsHit(GridGeometry::blockOf(voxel));
}

ScanReference::Answer ScanReference::isVoid(const VoxelIndex& voxel) const {
  Answer answer = isEmpty(voxel);
  for (int z = -1; z <= 1; ++z) {
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1 && answer != Answer::kNo; ++x) {
        if (std::abs(x) + std::abs(y) + std::abs(z) == 3) continue;  // across a corner
        const VoxelIndex neighbour{{voxel.x + x, voxel.y + y, voxel.z + z}};
        if (!isUpdated(neighbour)) return Answer::kNo;
        answer = std::min(answer, std::max(isEmpty(neighbour), seen(neighbour).bounds));
      }
    }
  }
  const auto keepAway = [&](int reach, auto&& keepsAway) {
    for (int z = -reach; z <= reach; ++z) {
      for (int y = -reach; y <= reach; ++y) {
        for (int x = -reach; x <= reach && reach > 0 && answer != Answer::kNo; ++x) {
          const Answer is_near = keepsAway(VoxelIndex{{voxel.x + x, voxel.y + y, voxel.z + z}});
          if (is_near == Answer::kYes) answer = Answer::kNo;
          if (is_near == Answer::kUndecided) answer = Answer::kUndecided;
        }
      }
    }
  };
  keepAway(config_.scan_rules.thin_reach, [&](const VoxelIndex& at) { return isThin(at); });
  keepAway(config_.scan_rules.void_margin, [&](const VoxelIndex& at) { return isMoving(at); });
  return answer;
}

ScanReference::Answer ScanReference::isMoving(const VoxelIndex& voxel) const {
  if (!isUpdated(voxel)) return Answer::kNo;
  const Seen own = seen(voxel);
  const Answer is_no_bound = own.bounds == Answer::kUndecided ? Answer::kUndecided
                             : own.bounds == Answer::kNo      ? Answer::kYes
                                                              : Answer::kNo;
  return std::min(own.hit, is_no_bound);
}

ScanReference::Answer ScanReference::isThin(const VoxelIndex& voxel) const {
  const VoxelIndex below{{voxel.x, voxel.y, voxel.z - 1}};
  if (!isUpdated(voxel) || !isUpdated(below)) return Answer::kNo;
  return std::min(seen(voxel).holds, isEmpty(below));
}

Value ScanReference::evidence(const VoxelIndex& voxel, ClassId label) const {
  Value value = unlimited(voxel, label);
  const ScanRules& rules = config_.scan_rules;
  const double most_hits = rules.most_hits, most_free = rules.most_free, threshold = rules.free_threshold,
               of_void = rules.void_evidence;
  if (label == kFreeClass) {
    const double all = std::min(value.sum, most_free);
    value.sum = std::min(std::max(value.sum - threshold, 0.0), most_free);
    if (threshold > 0.0 && std::isfinite(most_free)) {  // it does not apply above a crossed voxel
      const Value below = unlimited({{voxel.x, voxel.y, voxel.z - 1}}, kFreeClass);
      const double tolerance = below.tolerance(config_.kernel.scale);
      if (std::abs(below.sum - most_free) <= tolerance) value.slack += all - value.sum;
      if (below.sum - most_free > tolerance) value.sum = all;
    }
    if (of_void == 0.0 || !std::isfinite(most_free)) return value;
    const Answer is_void = isVoid(voxel);
    if (is_void == Answer::kYes) value.sum += of_void;
    if (is_void == Answer::kUndecided) value.slack += of_void;
    return value;
  }
  if (!std::isfinite(most_hits)) return value;
  const Value all = anyHit(voxel);
  if (all.slack > 0.0) value.slack += value.sum;
  if (all.sum > most_hits) value.sum *= most_hits / all.sum;
  return value;
}

int ScanReference::occluded(const VoxelIndex& voxel, double range) const {
  const Eigen::Vector3d centre = relativeCentre(voxel);
  bool beyond_end = false, close = false;
  for (const Eigen::Vector3d& beam : beams_) {
    double rho = 0.0, k = 0.0;
    if (!reaches(beam, centre, rho, k)) continue;
    if (k < 1e-9) close = true;
    if (std::min(std::abs(rho), std::abs(1.0 - rho)) < kClose) close = true;
    if (std::abs(rho * beam.norm() - range) < kClose) close = true;
    if (rho > 0.0 && rho < 1.0) return close ? -2 : 0;
    if (rho >= 1.0 && rho * beam.norm() <= range) beyond_end = true;
  }
  return close ? -2 : (beyond_end ? 1 : -1);
}

}  // namespace bki_mapping::reference
