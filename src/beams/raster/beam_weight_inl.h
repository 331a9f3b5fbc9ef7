/// @file The weight along a beam: uniform, linear or bilinear; part of line_kernels_inl.h.
#pragma once

#include "bki_mapping/beams/beam_config.h"

namespace bki_mapping {
namespace {

/// Equation (7) of docs/method.md: 0 unless 0 < rho < 1. @param rho minus kMiddle, so that the bilinear
/// weight, min(rho, 1 - rho), is one MinAbs and one difference.
template <BeamWeight kWeight>
struct VecWeight {
  static constexpr float kMiddle = kWeight == BeamWeight::kBilinear ? 0.5f : 0.0f;

  [[gnu::always_inline]] static FloatVec at(FloatVec rho) {
    if constexpr (kWeight == BeamWeight::kBilinear) {
      return 0.5f - MinAbs(rho, Set(0.5f));
    } else {
      const FloatVec weight = kWeight == BeamWeight::kUniform ? Set(1.0f) : rho;
      return IfThenElse((rho > 0.0f) & (rho < 1.0f), weight, FloatVec{});
    }
  }
};

}  // namespace
}  // namespace bki_mapping
