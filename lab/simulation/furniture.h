/// @file What stands in simulated rooms, all at rest.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "simulation/scene.h"
#include "simulation/street_parts.h"

namespace bki_mapping::simulation {

// SemanticKITTI has no classes of furniture. Its fixed classes stand for them, one for each kind of thing,
// so that figures by label tell them apart. Thin are cables and rods that hang or stand, small are boxes and
// cables on the floor.
constexpr std::uint32_t kFloor = 40, kWall = kBuilding, kTable = kFence, kChair = kTrunk,
                        kFurniture = kVegetation, kThin = kPole, kSmall = kSign, kTrolley = 20;

/// Where a piece of furniture stands. Its front looks along its own y axis.
struct Place {
  double x = 0.0, y = 0.0;  ///< of its middle [m]
  double yaw = 0.0;         ///< [rad]
};

constexpr double kTableHeight = 0.72, kTableTop = 0.04;  ///< of a table, and thickness of its top [m]

/// A top on four square legs. @param length, width, height [m].
void addTable(const Place& place, double length, double width, double height, std::vector<Shape>& shapes);
/// A seat on four thin legs, and a backrest between two uprights at its rear.
void addChair(const Place& place, std::vector<Shape>& shapes);
/// Open shelves with a back. @param length [m].
void addShelves(const Place& place, double length, std::vector<Shape>& shapes);
/// A closed block, such as a cupboard or a bed. @param length, width, height [m].
void addBlock(const Place& place, double length, double width, double height, std::uint32_t label,
              std::vector<Shape>& shapes);
void addSofa(const Place& place, std::vector<Shape>& shapes);
/// A vertical cable or rod of 1.2 cm radius. @param low, high its ends [m].
void addHangingCable(double x, double y, double low, double high, std::vector<Shape>& shapes);
/// A cable of 2 cm width that lies on the floor along the x axis of its place. @param length [m].
void addLyingCable(const Place& place, double length, std::vector<Shape>& shapes);
/// A lamp on a rod.
void addFloorLamp(double x, double y, std::vector<Shape>& shapes);

}  // namespace bki_mapping::simulation
