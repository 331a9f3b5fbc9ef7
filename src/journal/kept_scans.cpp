#include "journal/kept_scans.h"

#include <algorithm>
#include <utility>

namespace bki_mapping {

KeptScans::KeptScans(SemanticMapper& mapper, const MapCorrector::Settings& settings)
    : mapper_(mapper),
      corrector_(mapper.config(), mapper.sharedClasses(), settings,
                 {[&mapper](SemanticMap difference) {
                    mapper.addMap(std::move(difference));
                    return std::vector<GridIndex>();
                  },
                  [&mapper](const GridIndex& region, const LooksByBlock& looks) {
                    return mapper.replaceLooks(region, looks);
                  }}) {}

ScanStats KeptScans::integrate(const ScanView& scan, const Eigen::Isometry3d& T_map_sensor,
                               const std::string& sensor,
                               const std::optional<Eigen::Isometry3d>& T_odometry_sensor) {
  return add(corrector_.round(scan, T_map_sensor), sensor, T_odometry_sensor);
}

ScanStats KeptScans::integrateRecorded(const ScanView& scan, const Eigen::Isometry3d& T_map_sensor,
                                       const std::string& sensor,
                                       const std::optional<Eigen::Isometry3d>& T_odometry_sensor) {
  return add(corrector_.roundRecorded(scan, T_map_sensor), sensor, T_odometry_sensor);
}

ScanStats KeptScans::add(RoundedScan rounded, const std::string& sensor,
                         const std::optional<Eigen::Isometry3d>& T_odometry_sensor) {
  place(rounded.scan, rounded.T_map_sensor, placed_);
  ScanStats stats = mapper_.integrate(placed_);
  stats.counts += rounded.left_out;
  robot_ = rounded.T_map_sensor.translation();
  const auto known = std::find(sensors_.begin(), sensors_.end(), sensor);
  const auto number = static_cast<std::size_t>(known - sensors_.begin());
  if (known == sensors_.end()) sensors_.push_back(sensor);
  corrector_.addScan(std::move(rounded.scan), number, rounded.T_map_sensor,
                     T_odometry_sensor.value_or(rounded.T_map_sensor), mapper_.touchedBlocks());
  return stats;
}

void KeptScans::noteCleared(const Eigen::AlignedBox3d& box) {
  cleared_.push_back(box);
  corrector_.noteCleared(box);
}

void KeptScans::reset() {
  corrector_.reset();
  sensors_.clear();
  cleared_.clear();
}

}  // namespace bki_mapping
