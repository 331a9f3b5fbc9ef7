/// @file The map in test/store/data/version_N.bkm, as write_example_map makes it: a bit of everything that a
/// map file can hold, from formulas that any language can repeat.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "bki_mapping/store/map_file.h"

namespace bki_mapping {

/// The label_mask of the class table; files of version 1 have none.
constexpr std::uint32_t kExampleMask = 0xefffffff;

inline MapInfo exampleInfo() {
  std::vector<SemanticClass> classes(3);
  classes[0] = {0, "unlabelled", {0, 0, 0}, {}, true, true, false, false, true, std::nullopt};
  classes[1] = {40, "Stra\u00dfe", {128, 64, 255}, {40, 60, 4000000000u}, false, false, false, true, false,
                {}};
  classes[2] = {253, "car", {0, 0, 142}, {10, 252}, false, false, true, false, false, 2.5};
  MapInfo info;
  info.resolution = 0.25;
  info.prior = 0.001;
  info.frame = "map";
  info.classes = std::make_shared<ClassTable>("example", classes, kExampleMask);
  info.parameters = "resolution: 0.25\nfree_space:\n  mode: line\n";
  return info;
}

/// What the scan in a tick saw of voxel v of block (0, 0, 0), with m = tick mod 1009: s = (v (m mod 6 + 1) +
/// m) mod 7 is 1 (crossed), 2 (void) or 3 (hit), and nothing otherwise.
inline Look exampleLook(std::uint64_t tick) {
  Look::Voxels of[7];
  const std::size_t m = tick % 1009;
  for (std::size_t v = 0; v < kBlockVoxels; ++v) of[(v * (m % 6 + 1) + m) % 7][v] = true;
  return {tick, of[1], of[2], of[3]};
}
/// The ticks before kExampleTick, or in it, in which scans of a drive looked at block (0, 0, 0).
constexpr std::uint64_t kExampleTick = 6332993607;
inline std::vector<std::uint64_t> exampleAges(int drive) {
  if (drive == 1) return {3, 2000};
  return {0, 1, 5, 6, 40, 1000, 1001, 100000};
}

/// The evidence of a drive: that of drive 0 is in the sum only, that of drive 1 also has a part of its own.
/// @param version of the file: those before 3 hold no looks, and those before 6 no evidence that is mostly a
/// sum of what scans add with rules.
inline SemanticMap exampleMap(int drive, int version = 6) {
  SemanticMap map = exampleInfo().emptyMap();
  std::vector<EvidenceUnits> plane(kBlockVoxels);
  const auto add = [&](const BlockIndex& block, ClassId id, auto&& units_of) {
    for (std::size_t v = 0; v < plane.size(); ++v) {
      plane[v] = units_of(static_cast<std::uint32_t>(v));
    }
    map.getOrAllocate(block).add(id, plane.data());
  };
  const auto addLooks = [&] {
    if (version < 3) return;
    for (const std::uint64_t age : exampleAges(drive)) {
      map.getOrAllocate({{0, 0, 0}}).looks().add(exampleLook(kExampleTick - age));
    }
  };
  const auto only = [](std::uint32_t voxel, EvidenceUnits units) {
    return [=](std::uint32_t v) { return v == voxel ? units : 0; };
  };
  if (drive == 1) {
    add({{0, 0, 0}}, 40, [](std::uint32_t v) { return static_cast<EvidenceUnits>(v); });
    add({{-1, -1, -1}}, kFreeClass, only(511, -7));
    add({{-1, -1, -1}}, kFreeClass, only(0, kMostUnits));
    addLooks();
    return map;
  }
  add({{0, 0, 0}}, 40, only(3, kMostUnits));                // stops there with the other drive's 3
  add({{-1, -1, -1}}, kFreeClass, only(511, -kMostUnits));  // likewise
  add({{1, 0, 0}}, 40, [](std::uint32_t) { return 65536; });
  add({{1, 0, 0}}, 0, only(100, -1));
  for (const ClassId id :
       {ClassId{0}, ClassId{40}, ClassId{253}}) {  // incompressible: it fills several pages
    add({{7, 7, 7}}, id, [&](std::uint32_t v) {
      std::uint32_t mixed = (512u * id + v + 1u) * 2654435761u;
      mixed = (mixed ^ mixed >> 15) * 2246822519u;
      return static_cast<EvidenceUnits>((mixed ^ mixed >> 13) % 4294967295u - 2147483647u);
    });
  }
  if (version >= 6) {
    const auto rest = [](std::uint32_t v) { return v % 4 == 0 ? v : 0; };
    for (const std::uint32_t more : {0u, 5u}) {
      add({{2, static_cast<std::int32_t>(more), 0}}, kFreeClass, [&](std::uint32_t v) {
        return static_cast<EvidenceUnits>(38339 * ((v + more) % 3) + 98 * ((v + more) % 7) + rest(v) % 98);
      });
    }
    add({{-2, -1, -1}}, 40,
        [&](std::uint32_t v) { return static_cast<EvidenceUnits>(1278 * (v % 5 * 100) + rest(v)); });
  }
  Block::Occlusion marks;
  for (std::size_t v = 0; v < marks.size(); v += 3) marks[v] = true;
  map.getOrAllocate({{8, 0, -8}}).setOcclusion(marks);
  addLooks();
  return map;
}

inline std::vector<DriveRecord> exampleDrives() {
  DriveRecord first, second;
  first.id = "3f1c";
  first.name = "to the east";
  first.scans = 271;
  first.first_stamp = 1'700'000'000'000'000'001;
  first.last_stamp = 1'700'000'027'000'000'000;
  first.bounds = {Eigen::Vector3d(-2.0, -2.0, -16.0), Eigen::Vector3d(18.0, 16.0, 16.0)};
  second.id = "9e02";
  second.part = 1;  // without name, scans and bounds
  return {first, second};
}

/// The journal that files have since version 4. Its scans are of drive 3f1c.
inline std::vector<std::string> exampleSettings() {
  return {"resolution: 0.25\n", "resolution: 0.25\nfree_space:\n  mode: none\n"};
}
inline std::vector<Eigen::AlignedBox3d> exampleCleared() {
  const double endless = std::numeric_limits<double>::infinity();
  return {{Eigen::Vector3d(-1.0, 2.0, -endless), Eigen::Vector3d(1.5, 2.5, endless)}};
}
inline std::vector<ScanRecord> exampleScans() {
  ScanRecord first, second;
  first.number = 7;
  first.drive = "3f1c";
  first.stamp = 1'700'000'000'000'000'001;
  first.reach = 81.5;
  first.T_map_sensor.translation() = Eigen::Vector3d(4.0, -1.0 / 3.0, 1.75);
  first.tiles = {{-1, -1, -1}, {0, 0, 0}, {1, 0, 0}};
  second = first;
  second.number = 300;
  second.stamp = 1'700'000'027'000'000'000;
  second.sensor = "velodyne";
  second.settings = second.cleared = 1;
  second.jump = true;
  second.T_map_sensor.linear() << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  second.T_odometry_sensor.translation().x() = -0.125;
  second.tiles = {{0, 0, -70000}, {4000000, 0, 0}, {-1, 100, 0}};
  return {first, second};
}
/// Byte n of the content of a scan is n * number mod 251. (No scan is packed so; a map file does not look
/// into the content.) The second one takes more than a page.
inline std::string exampleContent(std::uint64_t number) {
  std::string content(number == 7 ? 100 : 10000, '\0');
  for (std::size_t n = 0; n < content.size(); ++n) content[n] = static_cast<char>(n * number % 251);
  return content;
}
inline void addExampleJournal(MapFile::Change& change) {
  for (const std::string& settings : exampleSettings()) change.addSettings(settings);
  for (const Eigen::AlignedBox3d& box : exampleCleared()) change.addClearedBox(box);
  for (const ScanRecord& scan : exampleScans()) change.addScan(scan, exampleContent(scan.number));
}

}  // namespace bki_mapping
