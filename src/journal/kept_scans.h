/// @file The scans of a program that maps, kept so that they can be moved to other poses.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "journal/map_corrector.h"

namespace bki_mapping {

/// Adds scans to the map of a mapper as they are kept: rounded in the sensor's frame. Not thread-safe.
class KeptScans {
 public:
  /// @param mapper must outlive this. @throws as MapCorrector.
  KeptScans(SemanticMapper& mapper, const MapCorrector::Settings& settings);

  /// Adds a scan to the map, and keeps it. @param scan as the mapper takes it. @param sensor name of its
  /// frame; "" if there is only one sensor. @param T_odometry_sensor its recorded pose in a frame that does
  /// not jump; by default, that in the map. @throws as SemanticMapper::integrate.
  ScanStats integrate(const ScanView& scan, const Eigen::Isometry3d& T_map_sensor,
                      const std::string& sensor = "",
                      const std::optional<Eigen::Isometry3d>& T_odometry_sensor = std::nullopt);
  /// The same of a scan in the axes of the sensor (MapCorrector::roundRecorded). @param scan its origin does
  /// not count.
  ScanStats integrateRecorded(const ScanView& scan, const Eigen::Isometry3d& T_map_sensor,
                              const std::string& sensor = "",
                              const std::optional<Eigen::Isometry3d>& T_odometry_sensor = std::nullopt);
  /// Does what is due between scans, with some milliseconds of this thread.
  void update() { corrector_.update(robot_); }
  /// Moves what is still to be moved, and packs all scans.
  void finish() { corrector_.finish(robot_); }

  // These note what happens to the map, as MapCorrector does.
  void noteCleared(const Eigen::AlignedBox3d& box);
  void noteForeign(const std::vector<GridIndex>& regions) { corrector_.noteForeign(regions); }
  void noteJump(std::uint64_t stamp) { corrector_.noteJump(stamp); }
  /// The map was emptied.
  void reset();

  MapCorrector& corrector() { return corrector_; }
  const MapCorrector& corrector() const { return corrector_; }
  /// Names of the sensors, by the numbers that the scans have (JournalScan::sensor).
  const std::vector<std::string>& sensors() const { return sensors_; }
  /// The boxes that were cleared, in order (map frame [m]).
  const std::vector<Eigen::AlignedBox3d>& cleared() const { return cleared_; }

 private:
  ScanStats add(RoundedScan rounded, const std::string& sensor,
                const std::optional<Eigen::Isometry3d>& T_odometry_sensor);

  SemanticMapper& mapper_;
  MapCorrector corrector_;
  std::vector<std::string> sensors_;
  std::vector<Eigen::AlignedBox3d> cleared_;
  Scan placed_;                                      ///< the last scan; its memory is used again
  Eigen::Vector3d robot_ = Eigen::Vector3d::Zero();  ///< where the last scan is
};

}  // namespace bki_mapping
