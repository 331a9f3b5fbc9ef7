/// @file A spinning lidar in a simulated scene.
#pragma once

#include "bki_mapping/sequence/sequence.h"
#include "simulation/scene.h"
#include "simulation/shape_index.h"
#include "simulation/weather.h"

namespace bki_mapping::simulation {

struct LidarConfig {
  int beams = 64;             ///< rows, spread evenly in elevation
  int columns = 1800;         ///< azimuth steps per revolution
  double lowest = -0.43;      ///< elevation of the first row [rad]
  double highest = 0.04;      ///< elevation of the last row [rad]
  double max_range = 80.0;    ///< range beyond which there is no return [m]
  double range_noise = 0.02;  ///< standard deviation [m]
  double label_noise = 0.0;   ///< fraction of points with the label of a random shape
  double rate = 10.0;         ///< revolutions per second [Hz]
  std::uint64_t seed = 1;     ///< of the noise
};

/// The rows of a sensor: "hdl64" (here the default, as spread out in KITTI), "hdl32" (+10.67 to -30.67
/// degrees) or "vlp16" (15 to -15 degrees), after Velodyne's data sheets. @throws std::invalid_argument if
/// there is no sensor of this name.
LidarConfig lidarNamed(const std::string& name);

/// Simulates one revolution without motion distortion: all beams are taken at the same time and pose.
/// @param time [s]. @param scan index of the scan, which seeds its noise.
/// @return points in the sensor frame with raw SemanticKITTI labels; the caller sets pose and stamp. Labels
/// of what is not there say so (isParticle, isImage).
SequenceFrame scan(const Scene& scene, const LidarConfig& lidar, const Eigen::Isometry3d& T_world_sensor,
                   double time, std::uint64_t scan, const WeatherConfig& conditions = {});

/// The settings that determine a drive: equal settings give equal scans.
struct DriveConfig {
  int scans = 100;         ///< number of scans
  double speed = 8.0;      ///< [m/s]
  std::uint64_t seed = 1;  ///< of the street
  LidarConfig lidar;
  SceneKind scene = SceneKind::kStreet;
  double height = 1.73;  ///< of the sensor above the ground, as in KITTI [m]
  /// Poses of the sensor in the world frame, whose z axis points up, for SceneKind::kTrajectory; at least
  /// `scans`.
  std::vector<Eigen::Isometry3d> trajectory = {};
  WeatherConfig weather = {};

  double duration() const { return static_cast<double>(scans) / lidar.rate; }  ///< [s]
};

/// A drive with the speed, the sensor and its height that are usual in a scene: at 8 m/s through a street, at
/// 3 in traffic, 2 in a crowd and 1 among arrivals; at 0.5 m/s with a lidar of 16 rows, 0.35 m above the
/// floor, through rooms.
DriveConfig usualDrive(SceneKind scene);

/// @throws std::invalid_argument if a setting is out of its limits.
void checkDrive(const DriveConfig& config);

/// A drive along the street of makeScene, round and round through its rooms, or along a trajectory.
class Drive {
 public:
  /// @throws std::invalid_argument if a setting is out of its limits.
  explicit Drive(const DriveConfig& config);

  std::size_t size() const { return static_cast<std::size_t>(config_.scans); }
  const Scene& scene() const { return scene_; }
  double timeOf(std::size_t i) const { return static_cast<double>(i) / config_.lidar.rate; }  ///< [s]
  Eigen::Isometry3d T_world_sensor(std::size_t i) const;
  /// Frame i with its stamp and its pose in the map frame, which is the sensor's frame at frame 0.
  SequenceFrame frame(std::size_t i) const;

 private:
  DriveConfig config_;
  Scene scene_;
  std::optional<ShapeIndex> index_;  ///< of a street along a trajectory, of which each scan sees little
};

}  // namespace bki_mapping::simulation
