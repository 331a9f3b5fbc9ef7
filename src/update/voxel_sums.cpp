#include "update/voxel_sums.h"

#include <algorithm>

namespace bki_mapping {
namespace {

void addTo(EvidenceUnits units, EvidenceUnits& sum, SumCounts& counts) {
  const EvidenceUnits most = kMostUnits - units;
  counts.saturated += sum > most && sum < kMostUnits;
  sum = std::min(sum, most) + units;
}
void withdrawFrom(EvidenceUnits units, EvidenceUnits& sum, SumCounts& counts) {
  counts.negative += sum >= 0 && sum < units;
  sum = std::max(sum, units - kMostUnits) - units;
}

/// Changes some voxels of a plane. @return whether any evidence in those voxels is not 0.
template <void (*kChange)(EvidenceUnits units, EvidenceUnits& sum, SumCounts& counts)>
bool changeVoxels(const LayerBits& voxels, EvidenceUnits units, EvidenceUnits* plane, SumCounts& counts) {
  constexpr int kLayer = kBlockEdge * kBlockEdge;
  EvidenceUnits any = 0;
  for (std::uint64_t bits : voxels) {
    if (bits == ~std::uint64_t{0}) {  // as most layers are; this loop becomes vectors
      SumCounts of_layer;
      for (int v = 0; v < kLayer; ++v) {
        kChange(units, plane[v], of_layer);
        any |= plane[v];
      }
      counts += of_layer;
    } else {
      for (; bits != 0; bits &= bits - 1) {
        EvidenceUnits& sum = plane[__builtin_ctzll(bits)];
        kChange(units, sum, counts);
        any |= sum;
      }
    }
    plane += kLayer;
  }
  return any != 0;
}

template <void (*kChange)(EvidenceUnits units, EvidenceUnits& sum, SumCounts& counts)>
bool changeLayer(std::uint64_t voxels, const EvidenceUnits* units, EvidenceUnits* plane, SumCounts& counts) {
  EvidenceUnits any = 0;
  for (; voxels != 0; voxels &= voxels - 1) {
    const int v = __builtin_ctzll(voxels);
    kChange(units[v], plane[v], counts);
    any |= plane[v];
  }
  return any != 0;
}

}  // namespace

bool addToVoxels(const LayerBits& voxels, EvidenceUnits units, EvidenceUnits* plane, SumCounts& counts) {
  return changeVoxels<addTo>(voxels, units, plane, counts);
}
bool withdrawFromVoxels(const LayerBits& voxels, EvidenceUnits units, EvidenceUnits* plane,
                        SumCounts& counts) {
  return changeVoxels<withdrawFrom>(voxels, units, plane, counts);
}
bool addToLayer(std::uint64_t voxels, const EvidenceUnits* units, EvidenceUnits* plane, SumCounts& counts) {
  return changeLayer<addTo>(voxels, units, plane, counts);
}
bool withdrawFromLayer(std::uint64_t voxels, const EvidenceUnits* units, EvidenceUnits* plane,
                       SumCounts& counts) {
  return changeLayer<withdrawFrom>(voxels, units, plane, counts);
}

}  // namespace bki_mapping
