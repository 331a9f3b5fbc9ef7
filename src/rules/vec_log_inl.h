/// @file Natural logarithms of vectors, over the vocabulary of simd/vec.h.
#pragma once

namespace bki_mapping {
namespace {

/// The largest relative error of log and logOnePlus. test/rules/read_block_test.cpp compares both with
/// std::log and std::log1p.
constexpr float kLogError = 5e-7f;

/// log(1 + f), the fraction of a logarithm. @param f from sqrt(1/2) - 1 to sqrt(2) - 1.
[[gnu::always_inline]] inline FloatVec logOfFraction(FloatVec f) {
  // The polynomial of Cephes's logf: minimax for log(1 + f) / f^3 without its first two terms. Those are kept
  // apart, so that small f lose nothing.
  constexpr float kCoefficients[] = {7.0376836292e-2f,  -1.1514610310e-1f, 1.1676998740e-1f,
                                     -1.2420140846e-1f, 1.4249322787e-1f,  -1.6668057665e-1f,
                                     2.0000714765e-1f,  -2.4999993993e-1f, 3.3333331174e-1f};
  FloatVec series = Set(kCoefficients[0]);
  for (int n = 1; n < 9; ++n) series = series * f + kCoefficients[n];
  const FloatVec square = f * f;
  return f + square * (f * series - 0.5f);
}

/// A positive number as (1 + f) 2^e, with f as logOfFraction takes it.
struct Binary {
  IntVec e;
  FloatVec f;
};
[[gnu::always_inline]] inline Binary split(FloatVec x) {
  constexpr int kMantissaBits = 23, kSqrtHalf = 0x3f3504f3;  // the bits of sqrt(1/2)
  const IntVec bits = BitCast<IntVec>(x), e = (bits - kSqrtHalf) >> kMantissaBits;
  return {e, BitCast<FloatVec>(bits - (e << kMantissaBits)) - 1.0f};
}

constexpr float kLogTwo = 0.69314718f;

/// log(x) for x from the smallest normal number to 1/2, and from 2 on. (Between them the logarithm may be
/// small, and the relative error is larger.)
[[gnu::always_inline]] inline FloatVec log(FloatVec x) {
  const Binary b = split(x);
  return ConvertTo<FloatVec>(b.e) * kLogTwo + logOfFraction(b.f);
}

/// log(1 + x) for finite x >= 0, however small.
[[gnu::always_inline]] inline FloatVec logOnePlus(FloatVec x) {
  const Binary b = split(1.0f + x);
  const FloatVec f = IfThenElse(b.e == 0, x, b.f);  // x has digits that 1 + x has lost
  return ConvertTo<FloatVec>(b.e) * kLogTwo + logOfFraction(f);
}

}  // namespace
}  // namespace bki_mapping
