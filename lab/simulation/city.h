/// @file A simulated city: a grid of streets, which several drives see at different times.
#pragma once

#include <vector>

#include "simulation/lidar.h"

namespace bki_mapping::simulation {

/// The settings that determine a city and its drives: equal settings give equal scans.
struct CityConfig {
  int drives = 8;            ///< number of drives
  int blocks = 3;            ///< blocks of houses along each side of the city
  double block_edge = 80.0;  ///< distance between the axes of parallel streets [m]
  DriveConfig drive;         ///< of each drive, except for its scene; the seed is that of the city
};

/// The way of a drive through the grid, in the right lane. It goes once around a block, and from then on
/// turns at random at each crossing.
class CityRoute {
 public:
  /// @param blocks, block_edge as in CityConfig. @param length [m].
  CityRoute(int blocks, double block_edge, double length, std::uint64_t seed, std::uint64_t drive);
  /// The pose of the sensor, 1.73 m above the ground. @param way that has been driven, up to `length` [m].
  Eigen::Isometry3d at(double way) const;

 private:
  /// A part of the way with constant curvature.
  struct Part {
    double begin;           ///< way at its start [m]
    Eigen::Vector2d start;  ///< [m]
    double heading;         ///< at its start [rad]
    double curvature;       ///< > 0: to the left [1/m]
  };
  std::vector<Part> parts_;
};

/// A drive through a city. Houses, trees and most parked cars are the same in all drives; some parking
/// spaces, the traffic and the pedestrians are its own. The world frame is that of the city: z = 0 is the
/// ground, and streets are along x and y at the multiples of block_edge from 0 on.
class CityDrive {
 public:
  CityDrive(const CityConfig& config, const Scene& city, std::uint64_t drive);

  std::size_t size() const { return static_cast<std::size_t>(config_.scans); }
  const Scene& scene() const { return scene_; }
  double timeOf(std::size_t i) const { return static_cast<double>(i) / config_.lidar.rate; }  ///< [s]
  Eigen::Isometry3d T_city_sensor(std::size_t i) const { return route_.at(config_.speed * timeOf(i)); }
  /// Frame i with its stamp and its pose in the frame of the city.
  SequenceFrame frame(std::size_t i) const;

 private:
  DriveConfig config_;
  CityRoute route_;
  Scene scene_;
};

class City {
 public:
  /// @throws std::invalid_argument if a setting is out of its limits.
  explicit City(const CityConfig& config);

  std::size_t size() const { return static_cast<std::size_t>(config_.drives); }
  /// What all drives have in common.
  const Scene& scene() const { return scene_; }
  CityDrive drive(std::size_t d) const { return {config_, scene_, d}; }

 private:
  CityConfig config_;
  Scene scene_;
};

}  // namespace bki_mapping::simulation
