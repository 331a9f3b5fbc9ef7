#include "kernel/kernel_table.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "core/pi.h"

namespace bki_mapping {
namespace {

/// Melkumyan and Ramos (2009), see sparse_kernel.h.
double formula(double r) {
  const double turn = 2.0 * kPi * r;
  return (2.0 + std::cos(turn)) / 3.0 * (1.0 - r) + std::sin(turn) / (2.0 * kPi);
}

/// The cubic polynomial that meets the kernel at the four Chebyshev nodes between a and b.
Eigen::Vector4d interpolate(double a, double b) {
  Eigen::Matrix4d powers;
  Eigen::Vector4d values;
  for (int n = 0; n < 4; ++n) {
    const double t = 0.5 * (a + b) + 0.5 * (b - a) * std::cos(kPi * (2 * n + 1) / 8.0);
    powers.row(n) << 1.0, t, t * t, t * t * t;
    values[n] = formula(std::sqrt((t - KernelTable::kShift) / KernelTable::kScale));
  }
  return powers.fullPivLu().solve(values);
}

KernelTable makeTable() {
  KernelTable table = {};
  for (int n = 0; n + 1 < KernelTable::kPieces; ++n) {
    const double low = n == 0 ? KernelTable::kShift : n - 0.5;
    const double high = std::min(n + 0.5, static_cast<double>(KernelTable::kScale) + KernelTable::kShift);
    const Eigen::Vector4d c = interpolate(low, high);
    for (int power = 0; power < 4; ++power) table.c[power][n] = static_cast<float>(c[power]);
  }
  return table;
}

}  // namespace

const KernelTable& kernelTable() {
  static const KernelTable table = makeTable();
  return table;
}

}  // namespace bki_mapping
