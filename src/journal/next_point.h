/// @file Where the point after another one of a scan probably is, the same to the bit everywhere.
#pragma once

#include <array>
#include <cfloat>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "journal/sensor_scan.h"

namespace bki_mapping {

using ScanPoints = std::vector<SensorScan::Coordinates>;

/// What leads from a point to the next one.
struct PointStep {
  /// Cosines and sines are multiples of 1 / kOne.
  static constexpr std::int32_t kOne = 1 << 20;

  /// The angle about the z axis between two points.
  std::int32_t cosine = kOne, sine = 0;
  /// Whether the next point is rather in the same direction, turned by this angle, than beside the point.
  bool along_ray = false;

  bool isValid() const { return cosine >= -kOne && cosine <= kOne && sine >= -kOne && sine <= kOne; }
};

/// Guesses the next point: the largest coordinate from the point before, and the others from both. Only
/// integers are added: of a product and a sum of rounded numbers, compilers may round only the sum, and
/// packed scans have to be read on other machines.
class NextPoint {
 public:
  static_assert(FLT_EVAL_METHOD == 0, "intermediate results must be rounded to double precision");

  NextPoint(const SensorScan::Coordinates& before, const PointStep& step) : along_ray_(step.along_ray) {
    const std::int64_t x = before[0], y = before[1], z = before[2];
    at_ = {step.cosine * x - step.sine * y, step.sine * x + step.cosine * y, step.kOne * z};
    if (!along_ray_) return;
    const std::int64_t sizes[] = {std::abs(at_[0]), std::abs(at_[1]), std::abs(at_[2])};
    axes_ = kAxes[sizes[2] > sizes[0] && sizes[2] > sizes[1] ? 2 : sizes[1] > sizes[0] ? 1 : 0];
  }
  /// The largest coordinate, then the other two.
  const std::array<std::uint8_t, 3>& axes() const { return axes_; }
  std::int32_t first() const { return straight(axes_[0]); }
  /// Takes the largest coordinate of the next point, for other().
  void setFirst(std::int32_t first) {
    const std::int64_t guessed = at_[axes_[0]];
    scale_ = guessed == 0 ? 0.0 : static_cast<double>(first) / static_cast<double>(guessed);
  }
  std::int32_t other(std::uint8_t axis) const {
    if (!along_ray_) return straight(axis);
    constexpr int kBits = 8;
    const double fine = scale_ * static_cast<double>(at_[axis] * (1 << kBits));
    return static_cast<std::int32_t>((static_cast<std::int64_t>(fine) + (1 << (kBits - 1))) >> kBits);
  }

 private:
  static constexpr std::array<std::uint8_t, 3> kAxes[] = {{0, 1, 2}, {1, 0, 2}, {2, 0, 1}};

  std::int32_t straight(std::uint8_t axis) const {
    return static_cast<std::int32_t>((at_[axis] + PointStep::kOne / 2) >> 20);
  }

  std::array<std::int64_t, 3> at_;  ///< as far away as the point before [quanta / PointStep::kOne]
  std::array<std::uint8_t, 3> axes_ = kAxes[0];
  double scale_ = 0.0;
  bool along_ray_;
};

}  // namespace bki_mapping
