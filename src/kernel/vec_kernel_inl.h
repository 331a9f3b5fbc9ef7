/// @file The sparse kernel of a vector of squared distances, over the vocabulary of simd/vec.h.
#pragma once

#include <cmath>
#include <type_traits>

#include "kernel/kernel_table.h"
#include "kernel/sparse_kernel.h"

namespace bki_mapping {
namespace {

/// By kernelTable(): a look-up in registers for each of four coefficients, three multiplications, and no
/// square root. It takes t = kScale (d / l)^2 + kShift.
template <typename Table>
class TableKernel {
 public:
  static constexpr float kScale = KernelTable::kScale, kShift = KernelTable::kShift;
  /// Factor by which distances, in kernel lengths, are multiplied before they are squared.
  static float unit() { return std::sqrt(kScale); }

  TableKernel() : TableKernel(kernelTable()) {}

  /// t from two perpendicular distances e and g.
  [[gnu::always_inline]] static FloatVec squared(FloatVec e, FloatVec g) { return e * e + kShift + g * g; }
  /// t of a squared distance. @param scale kScale / (its unit of the kernel's length)^2.
  [[gnu::always_inline]] static FloatVec squared(FloatVec d2, float scale) { return d2 * scale + kShift; }

  [[gnu::always_inline]] FloatVec operator()(FloatVec t) const {
    t = Min(t, Set(static_cast<float>(KernelTable::kPieces - 1)));
    // At 1.5 * 2^23 floats are whole numbers: the last bits of the sum are t, rounded.
    const IntVec piece = BitCast<IntVec>(t + 12582912.0f);
    return TableLookup(c_[0], piece) +
           t * (TableLookup(c_[1], piece) + t * (TableLookup(c_[2], piece) + t * TableLookup(c_[3], piece)));
  }

 private:
  explicit TableKernel(const KernelTable& table)
      : c_{Table(table.c[0]), Table(table.c[1]), Table(table.c[2]), Table(table.c[3])} {}

  Table c_[4];  ///< by power of t
};

/// By the polynomial of sparse_kernel.h: for instruction sets without Table32. It takes t = (d / l)^2.
class PolynomialKernel {
 public:
  static constexpr float kScale = 1.0f;
  static float unit() { return 1.0f; }

  [[gnu::always_inline]] static FloatVec squared(FloatVec e, FloatVec g) { return e * e + g * g; }
  [[gnu::always_inline]] static FloatVec squared(FloatVec d2, float scale) { return d2 * scale; }

  [[gnu::always_inline]] FloatVec operator()(FloatVec t) const {
    const FloatVec r = Sqrt(Max(t, FloatVec{}));  // rounding may make squares negative
    const FloatVec s = Max(1.0f - r, FloatVec{}), s2 = s * s;
    FloatVec q = kSparsePolynomial[0] * r + kSparsePolynomial[1];
    for (int n = 2; n < kSparseTerms; ++n) q = q * r + kSparsePolynomial[n];
    return q * (s2 * s2 * s);
  }
};

using VecKernel = std::conditional_t<kHasTable32, TableKernel<Table32>, PolynomialKernel>;

}  // namespace
}  // namespace bki_mapping
