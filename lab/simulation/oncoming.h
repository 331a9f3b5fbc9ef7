/// @file Cars that come towards a sensor on its way.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "simulation/lidar.h"
#include "simulation/plots.h"
#include "simulation/street_parts.h"
#include "simulation/way.h"

namespace bki_mapping::simulation {

/// Adds cars in the lane to the left of the way, which drive against it, and which appear and vanish out of
/// the sensor's range. None touches what stands, another car, or the sensor, from which all keep kClearance
/// at all times.
/// @param positions of the sensor at each scan. @param scene has the ground.
void addOncomingCars(const std::vector<Eigen::Vector3d>& positions, const Way& way, const Plots& plots,
                     const DriveConfig& config, Dice& dice, Scene& scene);

}  // namespace bki_mapping::simulation
