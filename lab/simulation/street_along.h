/// @file A street along the way of a sensor.
#pragma once

#include "simulation/lidar.h"

namespace bki_mapping::simulation {

/// How far everything keeps from the sensor at all times, and what stands from its whole way, seen from above
/// [m].
constexpr double kClearance = 1.6;

/// A street whose right lane is the way of the sensor: houses, hedges, fences, trees, lamp posts, signs,
/// parked cars and pedestrians on both sides, and oncoming cars. Where the sensor comes back into a street,
/// it is the same one. The ground follows the way, the sensor's height under it, as a smooth mean over all
/// passes. It depends on the positions of the trajectory, not on how the sensor is turned.
/// @param config of a drive along a trajectory, which has at least one pose. @throws std::invalid_argument
/// if passes of the same place differ so much in height that the ground would come within 0.3 m of the
/// sensor.
Scene makeStreetAlong(const DriveConfig& config);

}  // namespace bki_mapping::simulation
