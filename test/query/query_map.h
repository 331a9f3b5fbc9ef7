/// @file For tests of queries: random maps, and calls that are refused.
#pragma once

#include <gtest/gtest.h>

#include <limits>
#include <map>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "bki_mapping/rules/voxel_state.h"
#include "refusal_of.h"

namespace bki_mapping {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Expects that a call is refused with this sentence.
template <typename Call>
void expectRefused(const std::string& sentence, Call&& call) {
  EXPECT_EQ(refusalOf(call), sentence);
}

/// How a random map is made.
struct QueryMapKind {
  double resolution = 0.25;      ///< [m]
  int blocks = 3;                ///< along each axis, on either side of the origin
  double block_share = 0.8;      ///< of blocks that the map has
  double empty_share = 0.3;      ///< of these, without occupied voxels
  double occupied = 0.05;        ///< share of occupied voxels in other blocks
  double unknown = 0.1;          ///< share of unknown voxels; all others are free
  GridIndex centre = {0, 0, 0};  ///< [blocks]
};

/// Rules by which voxels depend on those around.
inline const StateRules& queryRules() {
  static const StateRules rules =
      StateRules().withFreeGain(7, 2.0).withHitOfScan(1.5).withNeighbourhood(0.15, 0b10001000);
  return rules;
}

/// Classes 0, 3 and 7, all three states, occlusion marks, and negative evidence.
inline SemanticMap queryMap(unsigned seed, const QueryMapKind& kind = {}) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  SemanticMap map(GridGeometry(kind.resolution), 0.001, 8);
  for (int z = -kind.blocks; z < kind.blocks; ++z) {
    for (int y = -kind.blocks; y < kind.blocks; ++y) {
      for (int x = -kind.blocks; x < kind.blocks; ++x) {
        if (unit(random) > kind.block_share) continue;
        const double occupied = unit(random) < kind.empty_share ? 0.0 : kind.occupied;
        std::map<ClassId, std::vector<EvidenceUnits>> planes;
        for (const ClassId id : {ClassId{0}, ClassId{3}, ClassId{7}, kFreeClass})
          planes[id].resize(kBlockVoxels);
        Block::Occlusion marks;
        for (std::size_t v = 0; v < kBlockVoxels; ++v) {
          const double u = unit(random);
          if (u < occupied) {
            constexpr ClassId kIds[] = {0, 3, 7};
            planes[kIds[random() % 3]][v] = unitsOf(1.0 + unit(random));
            planes[kFreeClass][v] = unitsOf(0.2 * unit(random));
          } else if (u < 1.0 - kind.unknown) {
            planes[kFreeClass][v] = unitsOf(1.0 + unit(random));
            planes[3][v] = random() % 2 == 0 ? -5 : unitsOf(0.3 * unit(random));
          } else {
            marks[v] = random() % 2 == 0;
          }
        }
        Block& block = map.getOrAllocate({{kind.centre.x + x, kind.centre.y + y, kind.centre.z + z}});
        for (const auto& [id, plane] : planes) block.add(id, plane.data());
        block.setOcclusion(marks);
      }
    }
  }
  return map;
}

/// The voxels along each axis on which a map of this kind may have something, and some beyond.
inline int extentOf(const QueryMapKind& kind) {
  return kind.blocks * kBlockEdge + 10;
}

}  // namespace bki_mapping
