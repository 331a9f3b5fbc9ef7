#include "bki_mapping/mapping/semantic_mapper.h"

#include <map>
#include <stdexcept>
#include <utility>

#include "bki_mapping/core/parameters.h"
#include "bki_mapping/core/stopwatch.h"
#include "bki_mapping/free_space/registry.h"

namespace bki_mapping {
namespace {

/// Checks every setting as if it were set by name.
MapperConfig checked(const MapperConfig& config, const ClassTable& classes) {
  std::map<std::string, std::string> values;
  for (const Parameter& p : mapperParameters()) values[p.name] = p.get(config);
  MapperConfig copy = config;
  setParameters(copy, values);
  if (config.unknown_labels == UnknownLabels::kUnlabelled && !classes.unlabelled()) {
    throw std::invalid_argument("unknown_labels is 'unlabelled', but class table '" + classes.name() +
                                "' flags no class as unlabelled; flag one, or set unknown_labels to ignore");
  }
  return config;
}

}  // namespace

SemanticMapper::SemanticMapper(const MapperConfig& config, std::shared_ptr<const ClassTable> classes)
    : config_(checked(config, *classes)),
      classes_(std::move(classes)),
      map_(GridGeometry(config_.resolution), config_.prior, classes_->size()),
      workers_(config_.threads),
      observer_(config_),
      hits_(map_.geometry(), config_.kernel),
      soft_hits_(map_.geometry(), config_.kernel),
      beams_(map_.geometry(), config_.kernel, config_.free_space.beam_index),
      free_space_(makeFreeSpaceModel(config_)),
      occlusion_(config_.occlusion) {
  applySettings();
}

void SemanticMapper::applySettings() {
  hits_.protectVoxels(config_.free_space.hits_before_misses);
  soft_hits_.protectVoxels(config_.free_space.hits_before_misses);
  hits_.protectEvidence(config_.free_space.evidence_before_misses);
  soft_hits_.protectEvidence(config_.free_space.evidence_before_misses);
  EvidenceLimits limits;
  if (config_.scan_limit.hits > 0.0) limits.hits = static_cast<float>(config_.scan_limit.hits);
  if (config_.scan_limit.free > 0.0) limits.free = static_cast<float>(config_.scan_limit.free);
  updater_.setLimits(limits);
  map_.setGainPersistence(config_.free_gain.persistence);
  for (const SemanticClass& c : classes_->classes()) {
    const FreeGainConfig& gain = config_.free_gain;
    const double of_kind = c.unlabelled ? 1.0 : (c.dynamic ? gain.dynamic_classes : gain.static_classes);
    map_.setFreeGain(c.id, c.free_gain.value_or(of_kind));
  }
}

void SemanticMapper::reconfigure(const MapperConfig& config) {
  const MapperConfig allowed = checked(config, *classes_);
  for (const Parameter& p : mapperParameters()) {
    if (p.get(allowed) != p.get(config_) && !changesWhileMapping(p.name)) {
      throw std::invalid_argument("parameter " + p.name +
                                  " cannot change while mapping; set it and start again");
    }
  }
  std::unique_ptr<FreeSpaceModel> free_space = makeFreeSpaceModel(allowed);
  config_ = allowed;
  free_space_ = std::move(free_space);
  observer_ = Observer(config_);
  occlusion_ = Occlusion(config_.occlusion);
  applySettings();
}

void SemanticMapper::reset() {
  map_.clear();
  block_bytes_ = 0;
}

ScanStats SemanticMapper::integrate(const Scan& scan) {
  if (!map_.geometry().contains(scan.origin)) {
    throw std::invalid_argument("the sensor's origin is not finite, or too far from the map's origin");
  }
  ScanStats stats;
  Stopwatch watch;
  const bool occludes = config_.occlusion != OcclusionExtent::kNone;
  const Observation& seen =
      observer_.observe(scan, *classes_, workers_, free_space_->needsBeams() || occludes);
  stats.counts = seen.counts;
  stats.hits = observer_.hits().size();
  stats.observe_ms = watch.lap();

  const bool soft = !seen.soft.empty();
  if (soft) {
    soft_hits_.setPoints(scan.origin, seen.hits, seen.soft);
  } else {
    hits_.setPoints(scan.origin, observer_.hits(), workers_);
  }
  beams_.setBeams(seen.beams);
  const FreeSpaceEvidence free = free_space_->observe(beams_, scan.stamp, workers_);
  evidence_.assign(1, soft ? static_cast<Evidence*>(&soft_hits_) : &hits_);
  if (free.evidence) evidence_.push_back(free.evidence);
  if (occludes) {
    const double max_range = scan.sensor_model.value_or(config_.sensor_model).max_range;
    const BeamField& field = beams_.field(workers_);
    occlusion_.setField(field, max_range > 0.0 ? max_range : field.longest());
    evidence_.push_back(&occlusion_);
  }
  stats.free_count = free.count;
  stats.evidence_ms = watch.lap();

  const MapUpdateStats update = updater_.update(map_, evidence_, workers_);
  stats.blocks = update.blocks;
  block_bytes_ += static_cast<std::size_t>(update.bytes);  // two's complement: may be negative
  stats.collect_ms = update.collect_ms;
  stats.update_ms = update.update_ms;
  return stats;
}

}  // namespace bki_mapping
