/// @file The weight along a beam of several places side by side; included by the inner loops alone.
#pragma once

#include "bki_mapping/beams/beam_config.h"
#include "simd/lanes.h"

namespace bki_mapping {
namespace {

/// Weights along beams, 0 unless 0 < rho < 1. @param rho less kMiddle, so that it needs no second difference.
template <BeamWeight kWeight>
struct Weight {
  static constexpr float kMiddle = kWeight == BeamWeight::kBilinear ? 0.5f : 0.0f;

  [[gnu::always_inline]] static FloatLanes at(FloatLanes rho) {
    if constexpr (kWeight == BeamWeight::kBilinear) {
      return 0.5f - lesserMagnitude(rho, FloatLanes{} + 0.5f);
    } else {
      const FloatLanes weight = kWeight == BeamWeight::kUniform ? FloatLanes{} + 1.0f : rho;
      return ((rho > 0.0f) & (rho < 1.0f)) ? weight : FloatLanes{};
    }
  }
};

}  // namespace
}  // namespace bki_mapping
