#include "bki_mapping/mapping/semantic_mapper.h"

#if defined(__GLIBC__)
#include <malloc.h>
#endif

#include <algorithm>
#include <cmath>
#include <new>
#include <stdexcept>
#include <utility>

#include "beams/occlusion.h"
#include "bki_mapping/map/semantic_map.h"
#include "bki_mapping/mapping/mapper_config.h"
#include "core/stopwatch.h"
#include "free_space/beam_samples.h"
#include "free_space/free_space_model.h"
#include "mapping/scan_preprocessor.h"
#include "mapping/sensor_height.h"
#include "points/point_evidence.h"
#include "rules/class_sets.h"
#include "update/map_updater.h"

namespace bki_mapping {
namespace {

/// @return the settings. @throws std::invalid_argument if any is not allowed.
MapperConfig checked(const MapperConfig& config, const ClassTable& classes) {
  checkParameters(config);
  if (config.unknown_labels == UnknownLabels::kUnlabelled && !classes.unlabelled()) {
    throw std::invalid_argument("unknown_labels is 'unlabelled', but class table '" + classes.name() +
                                "' flags no class as unlabelled; flag one, or set unknown_labels to ignore");
  }
  return config;
}

/// Returns freed memory to the system; the C library would keep most of it.
void returnMemory() {
#if defined(__GLIBC__)
  malloc_trim(0);
#endif
}

/// A rounded number for messages, like "41 million".
std::string about(double number) {
  for (const auto& [unit, name] : {std::pair(1e9, " billion"), std::pair(1e6, " million")}) {
    if (number >= unit) return numberText(std::round(10.0 * number / unit) / 10.0) + name;
  }
  return numberText(std::round(number));
}

std::string megabytes(double bytes) {
  return numberText(std::round(bytes / 1e6)) + " MB";
}

/// The limits of the update of a scan. @param map_bytes present memory of the map.
UpdateLimits limitsFor(const ScanView& scan, const MapperConfig& config, const GridGeometry& geometry,
                       std::size_t map_bytes) {
  UpdateLimits limits;
  if (config.scan_limit.blocks > 0) {
    limits.blocks = static_cast<std::size_t>(config.scan_limit.blocks);
  } else {
    // A cube about the sensor that holds all hits and their kernels, plus a block on each side for rounding.
    const double reach =
        scan.sensor_model.value_or(config.sensor_model).reach() + config.kernel.lengthFor(config.resolution);
    const double edge = std::ceil(2.0 * reach / geometry.blockSize()) + 2.0;
    constexpr auto kMost = static_cast<double>(ScanLimitConfig::kMostBlocks);
    limits.blocks = static_cast<std::size_t>(std::min(edge * edge * edge, kMost));
  }
  if (config.memory_limit > 0.0) {
    const double left = 1e6 * config.memory_limit - static_cast<double>(map_bytes);
    limits.bytes = static_cast<std::size_t>(std::clamp(left, 0.0, 1e18));
  }
  return limits;
}

/// The refusal of a scan that exceeds its limits: what it would need, and what to set.
/// @param map_bytes present memory of the map.
ScanRefused refusalOf(const TooMuchWork& work, const MapperConfig& config, std::size_t map_bytes) {
  const std::string resolution = numberText(config.resolution) + " m";
  switch (work.of()) {
    case TooMuchWork::What::kBlocks: {
      constexpr double kBlockBytes = sizeof(Block) + kBlockVoxels * sizeof(float);
      return {ScanRefused::Reason::kTooLarge,
              "the scan would touch about " + about(work.estimate()) + " blocks of 8 x 8 x 8 voxels of " +
                  resolution + ", " + megabytes(kBlockBytes * work.estimate()) +
                  ", more than scan_limit/blocks allows; use a coarser resolution, set "
                  "sensor_model/max_range to what the sensor sees, or raise scan_limit/blocks"};
    }
    case TooMuchWork::What::kSamples:
      return {ScanRefused::Reason::kTooLarge,
              "the scan would take about " + about(work.estimate()) + " free-space samples, more than " +
                  about(BeamSamples::kMost) + " in all or " + about(BeamSamples::kMostOfBeam) +
                  " on one beam; raise free_space/gap, lower free_space/samples_per_beam, or set "
                  "sensor_model/max_range "
                  "to what the sensor sees"};
    default:
      return {ScanRefused::Reason::kMemory, "the map holds " + megabytes(static_cast<double>(map_bytes)) +
                                                ", and the scan would make it larger than memory_limit, " +
                                                megabytes(1e6 * config.memory_limit) +
                                                "; raise memory_limit, or use a coarser resolution"};
  }
}

}  // namespace

struct SemanticMapper::Pipeline {
  MapperConfig config;  ///< applied()
  ScanRules rules;
  ScanPreprocessor preprocessor;
  PointEvidence hits;
  LazyBeamField beams;
  std::unique_ptr<FreeSpaceModel> free_space;
  Occlusion occlusion;
  SensorHeight height;
  MapUpdater updater;

  Pipeline(const MapperConfig& asked, const GridGeometry& geometry, const ClassTable& classes)
      : config(applied(asked)),
        rules(config.scan_rules),
        preprocessor(config),
        hits(geometry, config.kernel, rules.asksForHits(),
             rules.static_spread ? ClassSet() : fixedClasses(classes)),
        beams(geometry, config.kernel, config.free_space.beam_index),
        free_space(
            makeFreeSpaceModel({config.free_space, geometry, config.kernel, config.downsample_resolution})),
        occlusion(config.occlusion),
        height(classes) {
    rules.fixed = fixedClasses(classes);
    if (config.rules.enabled) rules.thin_reach = thinReach(classes, config.resolution);
  }

  /// The threshold of free space for a scan, whose hits the preprocessor holds.
  float thresholdFor(const ScanView& scan) {
    if (!config.rules.enabled) return config.scan_rules.free_threshold;
    if (!config.rules.has(Rule::kThreshold)) return 0.0f;
    double above = scan.sensor_model.value_or(config.sensor_model).height;
    if (!(above > 0.0)) above = height.in(preprocessor.hitGroups());
    if (!(above > 0.0)) return 0.0f;
    return static_cast<float>(
        groundThreshold(config.kernel.scale, config.kernel.lengthFor(config.resolution), above));
  }
};

SemanticMapper::SemanticMapper(const MapperConfig& config, std::shared_ptr<const ClassTable> classes)
    : config_(checked(config, *classes)),
      classes_(std::move(classes)),
      map_(GridGeometry(config_.resolution), applied(config_).prior, classes_->size()),
      state_rules_(config_.rules, *classes_, config_.resolution),
      pool_(std::make_unique<ThreadPool>(config_.threads)),
      pipeline_(std::make_unique<Pipeline>(config_, map_.geometry(), *classes_)) {}

SemanticMapper::~SemanticMapper() = default;

void SemanticMapper::reconfigure(const MapperConfig& config) {
  const MapperConfig allowed = checked(config, *classes_);
  checkChanges(config_, allowed);
  pipeline_ = std::make_unique<Pipeline>(allowed, map_.geometry(), *classes_);
  config_ = allowed;
  state_rules_ = StateRules(config_.rules, *classes_, config_.resolution);
}

void SemanticMapper::reset() {
  map_.clear();
  recover();
}

void SemanticMapper::recover() noexcept {
  pipeline_ = nullptr;
  if (map_.size() == 0) map_.clear();  // frees what a refused scan has allocated for the index
  countBlockBytes();
  returnMemory();
}

void SemanticMapper::countBlockBytes() noexcept {
  block_bytes_ = 0;
  for (const auto& [index, block] : map_.entries()) block_bytes_ += block->bytes();
}

template <typename Map>
void SemanticMapper::addCounting(Map&& other) {
  std::vector<BlockIndex> blocks;
  for (const auto& [index, ignored] : other.entries()) blocks.push_back(index);
  const auto bytesThere = [&] {
    std::size_t bytes = 0;
    for (const BlockIndex& index : blocks) {
      if (const Block* const block = map_.find(index)) bytes += block->bytes();
    }
    return bytes;
  };
  const std::size_t before = bytesThere();
  try {
    map_.add(std::forward<Map>(other));
  } catch (...) {
    countBlockBytes();  // planes may have been reserved
    throw;
  }
  block_bytes_ += bytesThere() - before;
}

void SemanticMapper::addMap(const SemanticMap& other) {
  addCounting(other);
}

void SemanticMapper::addMap(SemanticMap&& other) {
  addCounting(std::move(other));
}

SemanticMap SemanticMapper::takeRegion(const GridIndex& region) {
  SemanticMap taken = map_.takeRegion(region);
  for (const auto& [index, block] : taken.entries()) block_bytes_ -= block->bytes();
  return taken;
}

SemanticMap SemanticMapper::takeMap() {
  SemanticMap taken = std::exchange(map_, SemanticMap(map_.geometry(), map_.prior(), map_.classCount()));
  block_bytes_ = 0;
  return taken;
}

std::vector<GridIndex> SemanticMapper::replaceLooks(const GridIndex& region, const LooksByBlock& looks) {
  const auto bytesThere = [&] {
    std::size_t bytes = 0;
    if (const Region* const blocks = map_.findRegion(region)) {
      blocks->forEachIndex([&](const BlockIndex& b) { bytes += blocks->find(Region::numberOf(b))->bytes(); });
    }
    return bytes;
  };
  const std::size_t before = bytesThere();
  std::vector<GridIndex> changed = bki_mapping::replaceLooks(map_, region, looks);
  block_bytes_ += bytesThere() - before;
  return changed;
}

std::vector<GridIndex> SemanticMapper::clearBox(const Eigen::AlignedBox3d& box) {
  std::vector<GridIndex> changed = bki_mapping::clearBox(map_, box);
  countBlockBytes();
  return changed;
}

SemanticMapper::Pipeline& SemanticMapper::pipeline() {
  if (!pipeline_) pipeline_ = std::make_unique<Pipeline>(config_, map_.geometry(), *classes_);
  return *pipeline_;
}

const std::vector<GridIndex>& SemanticMapper::touchedBlocks() const {
  return pipeline_ ? pipeline_->updater.touched() : no_blocks_;
}

ScanStats SemanticMapper::integrate(const ScanView& scan) {
  return addOrWithdraw(scan, false);
}

ScanStats SemanticMapper::withdraw(const ScanView& scan) {
  const bool mapped = pipeline().free_space->dependsOnMap();
  if (mapped || config_.occlusion != OcclusionExtent::kNone) {
    throw std::logic_error(std::string("scans cannot be withdrawn with ") +
                           (mapped ? "free_space/extent: mapped" : "occlusion marks") +
                           ", which depend on the order of scans; set " +
                           (mapped ? "free_space/extent: observed" : "occlusion: none"));
  }
  return addOrWithdraw(scan, true);
}

ScanStats SemanticMapper::addOrWithdraw(const ScanView& scan, bool withdraws) {
  if (!map_.geometry().contains(scan.origin)) {
    throw std::invalid_argument(
        "the sensor's origin is not finite or too far from the map's origin; check the sensor's pose");
  }
  const auto memoryRanOut = [&] {
    recover();
    return ScanRefused(
        ScanRefused::Reason::kMemory,
        "a scan of " + std::to_string(scan.points.size()) +
            " points does not fit into the computer's memory; set memory_limit to less than the "
            "computer has, or use a coarser resolution");
  };
  try {
    return add(scan, withdraws);
  } catch (const TooMuchWork& work) {
    recover();
    throw refusalOf(work, config_, mapBytes());
  } catch (const std::bad_alloc&) {
    throw memoryRanOut();
  } catch (const std::length_error&) {  // more than a vector can hold
    throw memoryRanOut();
  }
}

/// Turns the hits and the free space of a scan into evidence, and adds the evidence to the map, or subtracts
/// it.
ScanStats SemanticMapper::add(const ScanView& scan, bool withdraws) {
  Pipeline& p = pipeline();
  ScanStats stats;
  Stopwatch watch;
  const bool occludes = config_.occlusion != OcclusionExtent::kNone;
  const PreprocessedScan& processed =
      p.preprocessor.process(scan, *classes_, *pool_, p.free_space->needsBeams() || occludes);
  stats.counts = processed.counts;
  stats.hits = processed.hit_count;
  stats.half_range = processed.half_range;
  stats.observe_ms = watch.lap();

  p.hits.setPoints(scan.origin, p.preprocessor.hitGroups(), *pool_);
  p.beams.setBeams(processed.beams);
  const FreeSpaceEvidence free = p.free_space->observe(p.beams, scan.stamp, *pool_);
  ScanEvidence evidence;
  evidence.withdraws = withdraws;
  evidence.stamp = scan.stamp;
  evidence.hits = &p.hits;
  evidence.free = free.evidence;
  if (occludes) {
    const SensorModelConfig& sensor = scan.sensor_model ? *scan.sensor_model : config_.sensor_model;
    const BeamField& field = p.beams.field(*pool_);
    const double range = sensor.knowsRange() ? sensor.max_range : field.longest();
    const auto edge = static_cast<double>(map_.geometry().safeRange(scan.origin));  // no indices beyond
    p.occlusion.setField(field, std::clamp(range, 0.0, std::max(edge, 0.0)));
    evidence.occlusion = &p.occlusion;
  }
  p.rules.free_threshold = p.thresholdFor(scan);
  stats.free_count = free.count;
  stats.evidence_ms = watch.lap();

  const MapUpdateStats update = p.updater.update(map_, evidence, *pool_, p.rules,
                                                 limitsFor(scan, config_, map_.geometry(), mapBytes()));
  stats.blocks = update.blocks;
  stats.not_finite = update.sums.not_finite;
  stats.saturated = update.sums.saturated;
  stats.negative = update.sums.negative;
  block_bytes_ += static_cast<std::size_t>(update.bytes);  // may be negative; the sum is right modulo 2^64
  stats.collect_ms = update.collect_ms;
  stats.update_ms = update.update_ms;
  return stats;
}

}  // namespace bki_mapping
