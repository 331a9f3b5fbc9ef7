/// @file The kernels: how much a hit or a beam says about a voxel at some distance.
#pragma once

#include <algorithm>
#include <cmath>

#include "bki_mapping/core/config.h"

namespace bki_mapping {

/// Sparse kernel of unit scale and support, Melkumyan and Ramos (2009), with r = d / l:
///     k(r) = (2 + cos(2 pi r)) / 3 * (1 - r) + sin(2 pi r) / (2 pi)   for r < 1, else 0.
/// (Equation (1) of Zhong and Peng lacks the factor 1 - r.) Near r = 1 the kernel falls off as (1 - r)^5, so
/// it is computed as (1 - r)^5 times a polynomial of degree 8, fitted for the least greatest error. The
/// result is within 1e-6 of the formula.
/// @param t r^2 = (d / l)^2, >= 0.
[[gnu::always_inline]] inline float sparseKernel(float t) {
  const float r = std::sqrt(t);
  const float s = 1.0f - r > 0.0f ? 1.0f - r : 0.0f;
  float q = -1.619635431551842f;
  q = q * r + 3.487306039115083f;
  q = q * r + 1.956194844059496f;
  q = q * r - 4.630355080484122f;
  q = q * r - 7.059915815199449f;
  q = q * r + 2.101813186048984f;
  q = q * r + 8.420268519966005f;
  q = q * r + 4.999999251507393f;
  q = q * r + 1.0000000053259894f;
  const float s2 = s * s;
  return q * (s2 * s2 * s);
}

/// A kernel in units of voxels.
struct VoxelKernel {
  KernelType type = KernelType::kSparse;
  float reach = 1.0f;           ///< l / resolution
  float inverse_reach2 = 1.0f;  ///< 1 / reach^2
  float scale = 1.0f;           ///< sigma0; 1 for the counting model

  VoxelKernel(const KernelConfig& config, double resolution)
      : type(config.type),
        reach(static_cast<float>(config.length / resolution)),
        inverse_reach2(static_cast<float>(resolution * resolution / (config.length * config.length))),
        scale(type == KernelType::kSparse ? static_cast<float>(config.scale) : 1.0f) {}
};

}  // namespace bki_mapping
