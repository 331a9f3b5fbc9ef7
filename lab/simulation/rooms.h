/// @file A flat of furnished rooms along a corridor, with people and doors.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>

#include "simulation/scene.h"

namespace bki_mapping::simulation {

constexpr double kCeiling = 2.6;      ///< height of rooms [m]
constexpr double kDoorHeight = 2.05;  ///< [m]
/// What the walls of the flat enclose, with the walls, the floor and the ceiling [m].
constexpr double kFlatFrom[] = {-0.1, -5.4, 0.0}, kFlatTo[] = {14.4, 7.7, 2.75};

/// Five rooms, of which the robot drives through four and sees the fifth through a door that slides, and a
/// corridor. @param seed equal seeds give equal rooms; walls are the same for all.
Scene makeRooms(std::uint64_t seed);

/// Pose on the round that the robot drives through the flat again and again, 0.35 m and more from all that
/// stands. @param way that has been driven [m]. @param height of the sensor [m].
Eigen::Isometry3d poseInRooms(double way, double height);
/// Length of one round [m].
double roundThroughRooms();

}  // namespace bki_mapping::simulation
