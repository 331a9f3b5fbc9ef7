/// @file Maps for tests of map files.
#pragma once

#include <memory>
#include <random>
#include <string>
#include <vector>

#include "bki_mapping/store/map_file.h"
#include "refusal_of.h"

namespace bki_mapping {

inline MapInfo infoOf(double resolution = 0.3) {
  std::vector<SemanticClass> classes(3);
  for (std::size_t i = 0; i < classes.size(); ++i) {
    classes[i].id = static_cast<ClassId>(40 * i);
    classes[i].name = "class " + std::to_string(i);
    classes[i].color = {static_cast<std::uint8_t>(i), 128, 255};
    classes[i].raw = {static_cast<std::uint32_t>(10 * i), 1000u + static_cast<std::uint32_t>(i)};
  }
  classes[0].unlabelled = classes[0].any_raw = true;
  classes[1].dynamic = classes[1].living = true;
  classes[1].free_gain = 2.5;
  classes[2].ground = classes[2].ignored = true;
  MapInfo info;
  info.resolution = resolution;
  info.prior = 0.001;
  info.frame = "a frame";
  info.classes = std::make_shared<ClassTable>("a table", classes);
  info.parameters = "resolution: 0.3\n";
  return info;
}

/// Blocks of any kind, in several tiles, on both sides of the origin.
inline SemanticMap randomMap(unsigned seed, int blocks = 60, int extent = 12) {
  std::mt19937 random(seed);
  SemanticMap map = infoOf().emptyMap();
  const auto draw = [&](int least, int most) {
    return std::uniform_int_distribution<int>(least, most)(random);
  };
  for (int b = 0; b < blocks; ++b) {
    Block& block = map.getOrAllocate({{draw(-extent, extent), draw(-extent, extent), draw(-9, 2)}});
    for (const ClassId id : {ClassId{0}, ClassId{40}, ClassId{80}, kFreeClass}) {
      if (draw(0, 2) == 0) continue;
      const int kind = draw(0, 3);
      std::vector<EvidenceUnits> plane(kBlockVoxels);
      for (EvidenceUnits& units : plane) {
        if (kind == 0) units = draw(0, 1000);
        if (kind == 1) units = draw(0, 9) == 0 ? draw(-5, kMostUnits) : 0;
        if (kind == 2) units = kMostUnits;
        if (kind == 3) units = 7;
      }
      plane[static_cast<std::size_t>(draw(0, kBlockVoxels - 1))] = -kMostUnits;
      block.add(id, plane.data());
    }
    if (draw(0, 4) == 0) {
      Block::Occlusion marks;
      marks[static_cast<std::size_t>(draw(0, kBlockVoxels - 1))] = true;
      block.setOcclusion(marks);
    }
    if (block.empty()) block.add(0, std::vector<EvidenceUnits>(kBlockVoxels, 1).data());
  }
  return map;
}

/// Adds looks of scans at various times to half of the blocks.
inline SemanticMap withLooks(SemanticMap map, unsigned seed) {
  std::mt19937 random(seed);
  for (const auto& [index, block] : sortedBlocks(map)) {
    if (random() % 2 == 0) continue;
    Looks& looks = map.getOrAllocate(index).looks();
    for (std::uint64_t age = random() % 20, n = 0; n < 10; ++n, age += age / 2 + random() % 20) {
      Look::Voxels of[4];
      for (std::size_t v = 0; v < kBlockVoxels; ++v) of[random() % 4][v] = true;
      looks.add(Look(6'000'000'000 - age, of[1], of[2], of[3]));
    }
  }
  return map;
}

inline DriveRecord driveOf(const std::string& id, int part = 0) {
  DriveRecord drive;
  drive.id = id;
  drive.name = "drive " + id;
  drive.part = part;
  drive.scans = 12;
  drive.first_stamp = 5;
  drive.last_stamp = 99;
  drive.bounds = {Eigen::Vector3d(-1.0, -2.0, -3.0), Eigen::Vector3d(1.0, 2.0, 3.0)};
  return drive;
}

/// The MapFileError that a call throws; "" if it throws none.
template <typename Call>
std::string sentenceOf(Call&& call) {
  return refusalOf<MapFileError>(call);
}

}  // namespace bki_mapping
