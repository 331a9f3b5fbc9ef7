#include "evaluation/map_evaluation.h"

#include <utility>

#include "bki_mapping/core/named_parameter.h"
#include "bki_mapping/rules/voxel_state.h"
#include "bki_mapping/sequence/sequence.h"
#include "simulation/weather.h"

namespace bki_mapping {
namespace {

std::string voxelRow(const GridGeometry& geometry, const VoxelIndex& voxel, const std::string& what) {
  const Eigen::Vector3d p = geometry.voxelCentre(voxel);
  return numberText(p.x()) + "," + numberText(p.y()) + "," + numberText(p.z()) + "," + what + "\n";
}

}  // namespace

TracesEvaluation::TracesEvaluation(const GridGeometry& geometry)
    : particles(geometry, simulation::isParticle, simulation::isNothing),
      images(geometry, simulation::isImage, simulation::isNothing) {}

void TracesEvaluation::add(const Scan& scan, Occupants& map) {
  particles.add(scan, map);
  images.add(scan, map);
}

OtherRun::OtherRun(std::string given, const MapperConfig& config, std::shared_ptr<const ClassTable> classes,
                   const KittiLabels& moving)
    : settings(std::move(given)),
      mapper(config, std::move(classes)),
      presence(mapper.map().geometry(), moving) {}

OctomapRun::OctomapRun(const std::string& given, const GridGeometry& geometry, const KittiLabels& moving)
    : settings(given),
      mapper(geometry.resolution(), octomapSettings(given)),
      presence(geometry, moving),
      traces(geometry) {}

MapEvaluation::MapEvaluation(const GridGeometry& geometry, const KittiLabels& moving, std::size_t scans,
                             std::size_t late, std::optional<CloudEvaluation> ground_truth_cloud)
    : dynamics(geometry, moving, scans, late),
      presence(geometry, moving),
      semantics(geometry, moving),
      occupancy(geometry, moving),
      cloud(std::move(ground_truth_cloud)) {}

void MapEvaluation::add(const Scan& scan, const std::vector<std::uint32_t>& predicted,
                        const ClassTable& classes) {
  dynamics.add(scan, classes);
  semantics.add(scan, predicted, classes);
  occupancy.add(scan);
  addPoints(scan);
  labels += scan.labels.size();
  for (const std::uint32_t label : scan.labels) {
    if (classes.classOf(label, labelValues(scan))) continue;
    ++unknown_labels;
    unknown_label = label;
  }
}

void MapEvaluation::addUnlabelled(const Scan& scan, const ClassTable& classes) {
  dynamics.add(cloud ? cloud->labelled(scan) : Scan(), classes, scan);
  addPoints(scan);
}

void MapEvaluation::addPoints(const Scan& scan) {
  if (truth) truth->add(scan);
  if (cloud) cloud->add(scan);
}

DynamicsEvaluation::Taken MapEvaluation::taken() const {
  if (!truth) return {};
  return [this](const VoxelIndex& voxel) { return truth->isTaken(voxel, end); };
}

void MapEvaluation::tellTruth() {
  const auto is_taken = [this](const VoxelIndex& voxel, double time) {
    return truth->isTaken(voxel, time - 1e-9 * static_cast<double>(Sequence::kFirstStamp));
  };
  presence.setTruth(is_taken);
  for (OtherRun& other : others) other.presence.setTruth(is_taken);
  for (OctomapRun& octomap : octomaps) octomap.presence.setTruth(is_taken);
}

MapQuality MapEvaluation::compare(const SemanticMapper& mapper) {
  const SemanticMap& map = mapper.map();
  const StateRules& rules = mapper.rules();
  MapQuality quality;
  quality.dynamics = dynamics.compare(map, rules, taken());
  MapOccupants occupants(map, rules);
  quality.presence = presence.quality(occupants);
  if (traces) quality.traces = traces->quality(occupants);
  const auto left = [&](const VoxelIndex& voxel) { return dynamics.hasBeenLeft(voxel, taken()); };
  const auto still_there = [&](const VoxelIndex& voxel) { return dynamics.isStillThere(voxel, taken()); };
  quality.semantics = semantics.compare(map, rules, still_there);
  quality.occupancy = occupancy.compare(map, rules, left);
  if (truth) quality.truth = truth->compare(map, rules, end);
  for (const OtherRun& other : others) {
    MapOccupants its(other.mapper.map(), other.mapper.rules());
    std::optional<TruthQuality> space;
    if (truth) space = truth->compare(its, end);
    quality.others.push_back({other.settings,
                              dynamics.compare(other.mapper.map(), other.mapper.rules(), taken()),
                              other.presence.quality(its), space, other.mapper.map().bytes()});
  }
  for (OctomapRun& octomap : octomaps) {
    std::optional<TruthQuality> space;
    if (truth) space = truth->compare(octomap.mapper, end);
    quality.octomaps.push_back({octomap.settings, dynamics.compare(octomap.mapper, taken()),
                                octomap.presence.quality(octomap.mapper),
                                occupancy.compare(octomap.mapper, left), space, std::nullopt,
                                octomap.times.median(), octomap.mapper.bytes()});
    if (traces) quality.octomaps.back().traces = octomap.traces.quality(octomap.mapper);
  }
  quality.bytes = map.bytes();
  if (cloud) quality.cloud = cloud->compare(map, rules);
  quality.labels = labels;
  quality.unknown_labels = unknown_labels;
  quality.unknown_label = unknown_label;
  forEachKnownVoxel(map, rules, [&](const VoxelIndex&, const VoxelView& view) {
    if (view.state == VoxelState::kOccupied) ++quality.voxels_by_class[view.label];
  });
  return quality;
}

std::string MapEvaluation::fateRows(const GridGeometry& geometry, Occupants& map) const {
  std::string csv = "x,y,z,what\n";
  constexpr const char* kNames[] = {"kept", "lost", "forgotten", "left"};
  for (const auto& [voxel, fate] : dynamics.fates(map, taken()))
    csv += voxelRow(geometry, voxel, kNames[static_cast<int>(fate)]);
  return csv;
}

std::string MapEvaluation::errorRows(const SemanticMapper& mapper) const {
  const SemanticMap& map = mapper.map();
  const StateRules& rules = mapper.rules();
  MapOccupants occupants(map, rules);
  std::string csv = fateRows(map.geometry(), occupants);
  const auto add = [&](const VoxelIndex& voxel, const char* what) {
    csv += voxelRow(map.geometry(), voxel, what);
  };
  for (const VoxelIndex& voxel : semantics.wrongVoxels(map, rules)) add(voxel, "wrong class");
  if (!truth) return csv;
  for (const VoxelIndex& voxel : truth->ghosts(map, rules, end)) add(voxel, "ghost");
  return csv;
}

}  // namespace bki_mapping
