/// @file The sparse kernel by its squared distance, in pieces.
#pragma once

namespace bki_mapping {

/// Cubic polynomials that make up the sparse kernel of unit scale. With r = d / l, t = kScale r^2 + kShift is
/// in piece n if it rounds to n; there k = c[0][n] + t (c[1][n] + t (c[2][n] + t c[3][n])). From t = kPieces
/// - 1.5 on, where r is 1 to within 4e-5, and up to kPieces - 1, k is 0. In single precision k is within 1e-6
/// of the formula; near r = 1 it may be as little as -1e-8. No square root is needed, and processors that
/// look up 32 numbers at a time need no branch.
struct KernelTable {
  static constexpr int kPieces = 32;
  /// The kernel bends most at r = 0, whose piece is therefore shorter than the others, but not by half.
  static constexpr float kShift = -0.09375f;
  static constexpr float kScale = 30.502f - kShift;

  alignas(64) float c[4][kPieces];
};

/// Made once, for all.
const KernelTable& kernelTable();

}  // namespace bki_mapping
