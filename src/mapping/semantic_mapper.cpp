#include "bki_mapping/mapping/semantic_mapper.h"

#include <map>
#include <stdexcept>
#include <utility>

#include "bki_mapping/core/parameters.h"
#include "bki_mapping/core/stopwatch.h"
#include "bki_mapping/free_space/registry.h"
#include "bki_mapping/inference/map_updater.h"
#include "bki_mapping/inference/occlusion.h"
#include "bki_mapping/inference/point_evidence.h"

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
      free_space_(makeFreeSpaceModel(config_)),
      map_(GridGeometry(config_.resolution), config_.prior, classes_->size()) {}

ScanStats SemanticMapper::integrate(const Scan& scan) {
  if (!map_.geometry().contains(scan.origin)) {
    throw std::invalid_argument("the sensor's origin is not finite, or too far from the map's origin");
  }
  ScanStats stats;
  Stopwatch watch;
  const Observation seen = observe(scan, *classes_, config_);
  stats.counts = seen.counts;
  stats.hits = seen.hits.points.size();
  stats.observe_ms = watch.lap();

  LazyBeamField beams(map_.geometry(), config_.kernel, config_.free_space.beam_index, seen.beams);
  const PointEvidence hits(map_.geometry(), config_.kernel, scan.origin, seen.hits);
  const FreeSpaceEvidence free = free_space_->observe(beams, scan.stamp);
  std::unique_ptr<Evidence> occlusion;
  if (config_.occlusion != OcclusionExtent::kNone) {
    const double max_range = config_.sensor_model.max_range;
    const double range = max_range > 0.0 ? max_range : beams.field()->longest();
    occlusion = std::make_unique<Occlusion>(beams.field(), config_.occlusion, range);
  }
  stats.free_count = free.count;
  stats.evidence_ms = watch.lap();

  std::vector<const Evidence*> evidence = {&hits};
  if (free.evidence) evidence.push_back(free.evidence.get());
  if (occlusion) evidence.push_back(occlusion.get());
  const MapUpdateStats update = updateMap(map_, evidence, config_.threads);
  stats.blocks = update.blocks;
  stats.collect_ms = update.collect_ms;
  stats.update_ms = update.update_ms;
  return stats;
}

}  // namespace bki_mapping
