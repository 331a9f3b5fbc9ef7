#include "simulation/furniture.h"

#include <cmath>

namespace bki_mapping::simulation {
namespace {

/// Adds parts in the axes of a piece of furniture.
class Builder {
 public:
  Builder(const Place& place, std::uint32_t label, std::vector<Shape>& shapes)
      : place_(place), label_(label), shapes_(shapes) {}

  /// @param x, y of the middle. @param low, high ends in z. @param length, width along x and y.
  void addBox(double x, double y, double low, double high, double length, double width) {
    add(ShapeType::kBox, x, y, low, high, length, width);
  }
  void addRod(double x, double y, double low, double high, double radius) {
    add(ShapeType::kCylinder, x, y, low, high, 2.0 * radius, 2.0 * radius);
  }

 private:
  void add(ShapeType type, double x, double y, double low, double high, double length, double width) {
    const double c = std::cos(place_.yaw), s = std::sin(place_.yaw);
    Shape shape{type,
                {place_.x + c * x - s * y, place_.y + s * x + c * y, 0.5 * (low + high)},
                {0.5 * length, 0.5 * width, 0.5 * (high - low)}};
    shape.yaw = place_.yaw;
    shape.label = label_;
    shapes_.push_back(shape);
  }

  Place place_;
  std::uint32_t label_;
  std::vector<Shape>& shapes_;
};

}  // namespace

void addTable(const Place& place, double length, double width, double height, std::vector<Shape>& shapes) {
  constexpr double kLeg = 0.05, kInset = 0.06;  // of the legs' middles from the edges [m]
  Builder table(place, kTable, shapes);
  table.addBox(0.0, 0.0, height - kTableTop, height, length, width);
  for (const double x : {kInset - 0.5 * length, 0.5 * length - kInset}) {
    for (const double y : {kInset - 0.5 * width, 0.5 * width - kInset})
      table.addBox(x, y, 0.0, height - kTableTop, kLeg, kLeg);
  }
}

void addChair(const Place& place, std::vector<Shape>& shapes) {
  constexpr double kEdge = 0.42, kSeat = 0.46, kTop = 0.9, kLeg = 0.015, kAtLeg = 0.5 * kEdge - 0.025;
  Builder chair(place, kChair, shapes);
  chair.addBox(0.0, 0.0, kSeat - 0.03, kSeat, kEdge, kEdge);
  for (const double x : {-kAtLeg, kAtLeg}) {
    chair.addRod(x, kAtLeg, 0.0, kSeat - 0.03, kLeg);
    chair.addRod(x, -kAtLeg, 0.0, kSeat - 0.03, kLeg);
    chair.addRod(x, -kAtLeg, kSeat, kTop, kLeg);
  }
  chair.addBox(0.0, -kAtLeg, 0.62, kTop, kEdge - 0.02, 0.025);
}

void addShelves(const Place& place, double length, std::vector<Shape>& shapes) {
  constexpr double kDepth = 0.35, kHeight = 1.9, kBoard = 0.02;
  Builder shelves(place, kFurniture, shapes);
  for (const double x : {-0.5 * (length - kBoard), 0.5 * (length - kBoard)})
    shelves.addBox(x, 0.0, 0.0, kHeight, kBoard, kDepth);
  shelves.addBox(0.0, -0.5 * (kDepth - kBoard), 0.0, kHeight, length, kBoard);
  for (int board = 0; board <= 5; ++board) {
    const double low = 0.06 + 0.36 * board;
    shelves.addBox(0.0, 0.0, low, low + kBoard, length, kDepth);
  }
}

void addBlock(const Place& place, double length, double width, double height, std::uint32_t label,
              std::vector<Shape>& shapes) {
  Builder(place, label, shapes).addBox(0.0, 0.0, 0.0, height, length, width);
}

void addSofa(const Place& place, std::vector<Shape>& shapes) {
  constexpr double kLength = 1.9, kDepth = 0.85, kBack = 0.2, kArm = 0.15;
  Builder sofa(place, kFurniture, shapes);
  sofa.addBox(0.0, 0.5 * kBack, 0.08, 0.42, kLength, kDepth - kBack);
  sofa.addBox(0.0, 0.5 * (kBack - kDepth), 0.08, 0.82, kLength, kBack);
  for (const double x : {0.5 * (kArm - kLength), 0.5 * (kLength - kArm)})
    sofa.addBox(x, 0.5 * kBack, 0.42, 0.6, kArm, kDepth - kBack);
  for (const double x : {-0.9, 0.9}) {
    for (const double y : {-0.37, 0.37}) sofa.addRod(x, y, 0.0, 0.08, 0.025);
  }
}

void addHangingCable(double x, double y, double low, double high, std::vector<Shape>& shapes) {
  Builder({x, y, 0.0}, kThin, shapes).addRod(0.0, 0.0, low, high, 0.012);
}

void addLyingCable(const Place& place, double length, std::vector<Shape>& shapes) {
  Builder(place, kSmall, shapes).addBox(0.0, 0.0, 0.0, 0.02, length, 0.02);
}

void addFloorLamp(double x, double y, std::vector<Shape>& shapes) {
  Builder lamp({x, y, 0.0}, kFurniture, shapes);
  lamp.addRod(0.0, 0.0, 0.0, 0.03, 0.15);
  Builder({x, y, 0.0}, kThin, shapes).addRod(0.0, 0.0, 0.03, 1.5, 0.015);
  lamp.addRod(0.0, 0.0, 1.5, 1.8, 0.18);
}

}  // namespace bki_mapping::simulation
