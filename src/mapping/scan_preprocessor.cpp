#include "mapping/scan_preprocessor.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "bki_mapping/core/grid_geometry.h"
#include "mapping/soft_merge.h"
#include "parallel/chunks.h"

namespace bki_mapping {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// What becomes of points with a label.
struct ClassOfLabel {
  ClassId id = 0;
  bool airborne = false, ground = false;
};

/// Looks up the classes of labels; remembers the last one, since neighbouring points often share a label.
class ClassFinder {
 public:
  ClassFinder(const ClassTable& classes, LabelValues values, const MapperConfig& config)
      : classes_(classes), values_(values), config_(config) {
    for (const SemanticClass& c : classes.classes()) {
      airborne_[c.id] = c.airborne;
      ground_[c.id] = c.ground;
    }
  }

  /// The class of a label; nullptr if hits with this label are skipped, which it counts. Valid until the next
  /// call.
  const ClassOfLabel* find(std::uint32_t label, PointCounts& counts) {
    if (knows_last_ && label == last_label_) return &last_;
    std::optional<ClassId> id = classes_.classOf(label, values_);
    knows_last_ = false;
    const bool listed = id.has_value();
    if (!listed) {
      ++counts.labels_not_in_table;
      if (config_.unknown_labels == UnknownLabels::kUnlabelled) id = classes_.unlabelled();
      if (!id) {
        ++counts.unknown_label;
        return nullptr;
      }
    }
    if (config_.unlabelled_points == UnlabelledPoints::kIgnore && id == classes_.unlabelled()) {
      ++counts.unlabelled;
      return nullptr;
    }
    knows_last_ = listed;
    last_label_ = label;
    last_ = {*id, airborne_[*id], ground_[*id]};
    return &last_;
  }

 private:
  const ClassTable& classes_;
  LabelValues values_;
  const MapperConfig& config_;
  ClassSet airborne_, ground_;
  bool knows_last_ = false;  ///< the last label is in the class table, and its hits are used
  std::uint32_t last_label_ = 0;
  ClassOfLabel last_;
};

/// The nearest float that is not below a number, or not above it.
float roundedUp(double number) {
  const auto nearest = static_cast<float>(number);
  return static_cast<double>(nearest) < number ? std::nextafter(nearest, kInfinity) : nearest;
}
float roundedDown(double number) {
  return -roundedUp(-number);
}

/// The ranges that hits can have.
class RangeLimits {
 public:
  /// @param none_at_max whether points at max_range mean that their beam had no return.
  RangeLimits(const SensorModelConfig& sensor, bool none_at_max)
      : sensor_(sensor),
        least_(std::max(kSensorRadius, roundedUp(sensor.min_range))),
        most_(roundedDown(sensor.reach())),
        none_at_max_(none_at_max) {}

  /// Whether a point at this range can be a hit; false for NaN and infinity.
  bool contains(float range) const { return range >= least_ && range <= most_ && !isAtMax(range); }
  bool isAtMax(float range) const { return none_at_max_ && isAtMaxRange(sensor_, range); }
  /// Counts a point that cannot be a hit under its reason. @return whether its beam is free up to max_range.
  bool countOutside(const Eigen::Vector3f& point, float range, PointCounts& counts) const {
    if (!point.allFinite()) {
      ++counts.not_finite;
    } else if (range < kSensorRadius) {
      ++counts.at_sensor;
    } else if (range < sensor_.min_range) {
      ++counts.too_near;
    } else if (isAtMax(range)) {
      ++counts.no_returns;
      return true;
    } else {
      ++counts.beyond_max;
      return sensor_.knowsRange();
    }
    return false;
  }

 private:
  const SensorModelConfig& sensor_;
  float least_, most_;
  bool none_at_max_;
};

bool areShares(const ClassShare* begin, const ClassShare* end) {
  return std::all_of(begin, end, [](const ClassShare& s) { return isProbability(s.share); });
}

/// The position of a range >= 0 in a histogram. (Converting to an unsigned number takes several
/// instructions.)
std::size_t metreOf(float range) {
  constexpr auto kLast = static_cast<float>(RangeHistogram().size() - 1);
  return static_cast<std::size_t>(static_cast<std::int32_t>(std::min(range, kLast)));
}

/// The range within which half of the points are [m]. @param points number of them; 0 gives 0.
double medianOf(const std::vector<RangeHistogram>& chunks, std::size_t points) {
  if (points == 0) return 0.0;
  const double half = 0.5 * static_cast<double>(points);
  double before = 0.0;
  for (std::size_t metre = 0; metre < RangeHistogram().size(); ++metre) {
    double here = 0.0;
    for (const RangeHistogram& chunk : chunks) here += chunk[metre];
    if (before + here >= half) return static_cast<double>(metre) + (half - before) / here;
    before += here;
  }
  return static_cast<double>(RangeHistogram().size());
}

}  // namespace

PointCounts& PointCounts::operator+=(const PointCounts& other) {
  for (const auto count :
       {&PointCounts::points, &PointCounts::used, &PointCounts::not_finite, &PointCounts::at_sensor,
        &PointCounts::too_near, &PointCounts::beyond_max, &PointCounts::outside_map,
        &PointCounts::unknown_label, &PointCounts::unlabelled, &PointCounts::airborne, &PointCounts::isolated,
        &PointCounts::no_direction, &PointCounts::no_returns, &PointCounts::labels_not_in_table}) {
    this->*count += other.*count;
  }
  return *this;
}

void ScanPreprocessor::sortPoints(const ScanView& scan, const ClassTable& classes, std::size_t first,
                                  std::size_t last, const Sorted& into) const {
  const float safe_range = cells_.safeRange(scan.origin);
  const SensorModelConfig& sensor = scan.sensor_model ? *scan.sensor_model : config_.sensor_model;
  const RangeLimits limits(sensor, scan.no_returns_at_max_range);
  ClassFinder finder(classes, scan.labels_are_ids ? LabelValues::kId : config_.label_values, config_);
  PointCounts counts;
  counts.points = last - first;
  for (std::size_t i = first; i < last; ++i) {
    const Eigen::Vector3f& point = scan.points[i];
    const float range = point.norm();
    if (!limits.contains(range)) {
      if (limits.countOutside(point, range, counts) &&
          (config_.clear_beyond_max_range || limits.isAtMax(range))) {
        addCut(scan.origin, point * (static_cast<float>(sensor.max_range) / range), into.cut);
      }
    } else if (!(range < safe_range) && !cells_.contains(scan.origin + point.cast<double>())) {
      ++counts.outside_map;
    } else if (scan.soft && !areShares(scan.soft->begin(i), scan.soft->end(i))) {
      ++counts.not_finite;
    } else if (const ClassOfLabel* const found = finder.find(scan.labels[i], counts)) {
      const bool is_alone = isolated_ && (*isolated_)[i];
      if (found->airborne || (is_alone && !found->ground)) {
        ++(found->airborne ? counts.airborne : counts.isolated);
        into.cut.add(point, kFreeClass);
        continue;
      }
      ++counts.used;
      ++into.ranges[metreOf(range)];
      into.hits.add(point, found->id);
      if (scan.soft) into.used.push_back({static_cast<std::uint32_t>(i), found->id});
    }
  }
  into.counts = counts;
}

void ScanPreprocessor::addCut(const Eigen::Vector3d& origin, const Eigen::Vector3f& end,
                              Downsampler::Input& cut) const {
  if (cells_.contains(origin + end.cast<double>())) cut.add(end, kFreeClass);
}

void ScanPreprocessor::addNoReturns(const ScanView& scan, Downsampler::Input& cut) {
  const SensorModelConfig& sensor = scan.sensor_model ? *scan.sensor_model : config_.sensor_model;
  for (const Eigen::Vector3f& direction : scan.no_returns) {
    const float length = direction.norm();
    ++processed_.counts.points;
    if (direction.isZero(0.0f)) {
      ++processed_.counts.no_direction;
      continue;
    }
    if (!direction.allFinite() || !(length > 0.0f) || !sensor.knowsRange()) {
      ++processed_.counts.not_finite;
      continue;
    }
    ++processed_.counts.no_returns;
    addCut(scan.origin, direction * (static_cast<float>(sensor.max_range) / length), cut);
  }
}

const PreprocessedScan& ScanPreprocessor::process(const ScanView& scan, const ClassTable& classes,
                                                  ThreadPool& pool, bool beams) {
  if (scan.labels.size() != scan.points.size()) {
    throw std::invalid_argument("the scan has " + std::to_string(scan.points.size()) + " points but " +
                                std::to_string(scan.labels.size()) + " labels; give each point one label");
  }
  if (scan.soft && scan.soft->size() != scan.points.size()) {
    throw std::invalid_argument("the scan has " + std::to_string(scan.points.size()) +
                                " points but soft labels for " + std::to_string(scan.soft->size()) +
                                "; give each point its soft labels");
  }
  const bool seeks = config_.rules.enabled && config_.rules.particles_within > 0.0;
  isolated_ = seeks ? &isolation_.find(scan.points, static_cast<float>(config_.rules.particles_within), pool)
                    : nullptr;
  const Chunks chunks(scan.points.size());
  if (used_.size() < chunks.count()) used_.resize(chunks.count());
  for (auto& used : used_) used.clear();
  const bool ordered = beams || scan.soft;
  const std::size_t no_returns = chunks.count();  // position of their own chunk, after those of the points
  hits_.start(scan.origin, chunks.count(), pool, ordered);
  cut_.start(scan.origin, chunks.count() + 1, pool, true);
  counts_.assign(chunks.count(), {});
  ranges_.assign(chunks.count(), {});
  pool.forEach(chunks.count(), [&](std::size_t c, std::size_t worker) {
    sortPoints(scan, classes, chunks.begin(c), chunks.end(c),
               {hits_.open(c, worker), cut_.open(c, worker), used_[c], counts_[c], ranges_[c]});
    hits_.close(c, worker);
    cut_.close(c, worker);
  });
  processed_.counts = {};
  for (const PointCounts& counts : counts_) processed_.counts += counts;
  processed_.half_range = medianOf(ranges_, processed_.counts.used);
  addNoReturns(scan, cut_.open(no_returns, 0));
  cut_.close(no_returns, 0);
  hits_.finish(pool);
  processed_.hits.points.clear();
  processed_.hits.labels.clear();
  if (ordered) hits_.inOrder(pool, processed_.hits);
  hit_groups_ = hits_.merged();
  processed_.hit_count = sizeOf(hits_.merged());
  soft_.clear();
  if (scan.soft) soft_ = mergeSoftLabels(scan, used_, config_.downsample_resolution, processed_.hits);
  if (!soft_.empty()) hit_groups_.clear();
  for (const MergedPoints& group : soft_) hit_groups_.push_back(&group);
  processed_.beams.origin = scan.origin;
  processed_.beams.ends.clear();
  if (beams) {
    cut_.finish(pool);
    cut_.inOrder(pool, cut_points_);
    appendBeams(processed_.hits.points, pool);
    appendBeams(cut_points_.points, pool);
  }
  return processed_;
}

void ScanPreprocessor::appendBeams(const std::vector<Eigen::Vector3f>& ends, ThreadPool& pool) {
  std::vector<Eigen::Vector3f>& beams = processed_.beams.ends;
  const std::size_t before = beams.size();
  beams.resize(before + ends.size());
  const Chunks chunks(ends.size());
  std::atomic<bool> any_too_short{false};
  const auto isTooShort = [](const Eigen::Vector3f& end) { return end.norm() < kSensorRadius; };
  pool.forEach(chunks.count(), [&](std::size_t c, std::size_t) {
    bool too_short = false;
    for (std::size_t i = chunks.begin(c); i < chunks.end(c); ++i) {
      beams[before + i] = ends[i];
      too_short |= isTooShort(ends[i]);
    }
    if (too_short) any_too_short = true;
  });
  if (any_too_short) beams.erase(std::remove_if(beams.begin(), beams.end(), isTooShort), beams.end());
}

}  // namespace bki_mapping
