/// @file The kernels: how much a hit or a beam says about a voxel at some distance.
#pragma once

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "bki_mapping/kernel/kernel_config.h"

namespace bki_mapping {

/// Sparse kernel of unit scale and support, Melkumyan and Ramos (2009), with r = d / l:
///     k(r) = (2 + cos(2 pi r)) / 3 * (1 - r) + sin(2 pi r) / (2 pi)   for r < 1, else 0.
/// (Equation (1) of Zhong and Peng lacks the factor 1 - r.) Near r = 1 the kernel falls off as (1 - r)^5, so
/// it is computed as (1 - r)^5 times a polynomial of degree 6, fitted for the least greatest error, 6e-7.
/// With rounding the result is within 1e-6 of the formula. These are the coefficients, of r^6 first.
constexpr int kSparseTerms = 7;
constexpr float kSparsePolynomial[kSparseTerms] = {
    4.7855168148542475f, -5.6925235501933855f, -6.8854927828244925f, 2.096001637192428f,
    8.419096650581338f,  5.000077953447409f,   0.9999994177910798f};

/// @param t r^2 = (d / l)^2, >= 0.
[[gnu::always_inline]] inline float sparseKernel(float t) {
  const float r = std::sqrt(t), s = 1.0f - r > 0.0f ? 1.0f - r : 0.0f, s2 = s * s;
  float q = kSparsePolynomial[0];
  for (int n = 1; n < kSparseTerms; ++n) q = q * r + kSparsePolynomial[n];
  return q * (s2 * s2 * s);
}

/// A kernel in units of voxels.
struct VoxelKernel {
  /// The farthest that a sparse kernel may reach [voxels]: fixed-point positions and the lists of blocks
  /// around a point are made for it.
  static constexpr double kMaxReach = 72.0;

  KernelType type = KernelType::kSparse;
  float reach = 1.0f;           ///< l / resolution
  float inverse_reach2 = 1.0f;  ///< 1 / reach^2
  float scale = 1.0f;           ///< sigma0; 1 for the counting model
  float total = 1.0f;           ///< what a point adds to all voxels together, on average over its position

  /// @throws std::invalid_argument if a sparse kernel is longer than kMaxReach voxels.
  VoxelKernel(const KernelConfig& config, double resolution)
      : type(config.type), scale(type == KernelType::kSparse ? static_cast<float>(config.scale) : 1.0f) {
    const double length = config.lengthFor(resolution);
    constexpr double kRounding = 1.0 + 1e-9;  // of the quotient
    if (type == KernelType::kSparse && !(length <= kMaxReach * kRounding * resolution)) {
      throw std::invalid_argument(
          "kernel/length is more than 72 voxels; make it shorter, or resolution coarser");
    }
    reach = static_cast<float>(length / resolution);
    inverse_reach2 = static_cast<float>(resolution * resolution / (length * length));
    if (type == KernelType::kSparse) {
      constexpr double kHalfTurn = 3.14159265358979323846;  // pi
      constexpr double kIntegral =
          2.0 * kHalfTurn / 9.0 - 4.0 / (3.0 * kHalfTurn);  // of k(r) over the unit ball
      total = static_cast<float>(config.scale * kIntegral * std::pow(length / resolution, 3.0));
    }
  }
};

}  // namespace bki_mapping
