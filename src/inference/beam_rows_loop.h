/// @file The loop of beam_rows.h; each instruction set's file includes it and gets a copy of its own.
#pragma once

#include "bki_mapping/inference/beam_raster.h"
#include "bki_mapping/inference/kernel.h"

namespace bki_mapping {
namespace {

/// Weight along a beam, 0 unless 0 < rho < 1.
template <BeamWeight kWeight>
[[gnu::always_inline]] inline float weightAt(float rho) {
  if (kWeight == BeamWeight::kBilinear) {
    const float least = rho < 1.0f - rho ? rho : 1.0f - rho;
    return least > 0.0f ? least : 0.0f;
  }
  const float weight = kWeight == BeamWeight::kUniform ? 1.0f : rho;
  return (rho > 0.0f) & (rho < 1.0f) ? weight : 0.0f;
}

template <BeamWeight kWeight>
void addWeightedRows(const LocalBeam* beams, std::size_t count, float reach, float* sums) {
  const float inverse_reach2 = 1.0f / (reach * reach);
  for (std::size_t b = 0; b < count; ++b) {
    const LocalBeam beam = beams[b];
    forEachNearRow(beam, reach, [&](const NearRow& row) {
      float* out = sums + row.offset;
      for (int i = 0; i < kBlockEdge; ++i) {
        const float dx = static_cast<float>(i) - row.x;
        const float t = (row.distance2 + beam.g * dx * dx) * inverse_reach2;
        out[i] += weightAt<kWeight>(row.rho + static_cast<float>(i) * row.rho_step) * sparseKernel(t);
      }
    });
  }
}

void addRows(const LocalBeam* beams, std::size_t count, BeamWeight weight, float reach, float* sums) {
  switch (weight) {
    case BeamWeight::kUniform:
      return addWeightedRows<BeamWeight::kUniform>(beams, count, reach, sums);
    case BeamWeight::kLinear:
      return addWeightedRows<BeamWeight::kLinear>(beams, count, reach, sums);
    case BeamWeight::kBilinear:
      return addWeightedRows<BeamWeight::kBilinear>(beams, count, reach, sums);
  }
}

}  // namespace
}  // namespace bki_mapping
