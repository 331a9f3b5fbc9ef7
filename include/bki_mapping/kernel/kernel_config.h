/// @file Settings of the kernel.
#pragma once

namespace bki_mapping {

/// The sparse kernel, Equation (1) of docs/method.md, or the counting sensor model (S-CSM), Equation (2).
enum class KernelType { kSparse, kCounting };
struct KernelConfig {
  KernelType type = KernelType::kSparse;
  double length = 0.0;  ///< support radius l [m]; 0: equal to the resolution
  double scale = 0.1;   ///< sigma0, the kernel's value at distance 0

  /// The support radius that applies [m]. @param resolution edge of a voxel [m].
  double lengthFor(double resolution) const { return length > 0.0 ? length : resolution; }
};

}  // namespace bki_mapping
