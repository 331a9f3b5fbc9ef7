/// @file The sparse kernel of several squared distances side by side; included by the inner loops alone.
#pragma once

#include <cmath>

#include "kernel/kernel_table.h"
#include "kernel/sparse_kernel.h"
#include "simd/lanes.h"

namespace bki_mapping {
namespace {

#if defined(__AVX512F__)

/// By table, which AVX-512 looks up in registers.
class LaneKernel {
 public:
  /// Of the squared distance that operator() takes: kScale (d / l)^2 + kShift.
  static constexpr float kScale = KernelTable::kScale, kShift = KernelTable::kShift;
  static float unit() { return std::sqrt(kScale); }

  LaneKernel() {
    const KernelTable& table = kernelTable();
    for (int power = 0; power < 4; ++power) {
      low_[power] = _mm512_load_ps(table.c[power]);
      high_[power] = _mm512_load_ps(table.c[power] + kLanes);
    }
  }

  [[gnu::always_inline]] FloatLanes operator()(FloatLanes t) const {
    t = lesser(t, FloatLanes{} + static_cast<float>(KernelTable::kPieces - 1));
    // At 1.5 * 2^23 floats are whole numbers: the sum's last bits are the piece's number.
    const auto piece = reinterpret_cast<__m512i>(t + 12582912.0f);
    const auto c = [&](int power) {
      return static_cast<FloatLanes>(_mm512_permutex2var_ps(low_[power], piece, high_[power]));
    };
    return c(0) + t * (c(1) + t * (c(2) + t * c(3)));
  }

 private:
  __m512 low_[4], high_[4];
};

#else

/// By polynomial in the distance.
class LaneKernel {
 public:
  static constexpr float kScale = 1.0f, kShift = 0.0f;
  static float unit() { return 1.0f; }

  [[gnu::always_inline]] FloatLanes operator()(FloatLanes t) const {
    const FloatLanes r = squareRoot(greater(t, FloatLanes{}));  // rounding may make squares negative
    return sparseKernel(r, greater(1.0f - r, FloatLanes{}));
  }
};

#endif

}  // namespace
}  // namespace bki_mapping
