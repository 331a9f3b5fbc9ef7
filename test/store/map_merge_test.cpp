// Merged maps: the sum of their drives, each once, as SemanticMap::add makes it of maps in memory.
#include "bki_mapping/store/map_merge.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "bki_mapping/rules/voxel_state.h"
#include "reference/content.h"
#include "store/counted_memory.h"
#include "store/drives.h"
#include "store/grid_transform.h"
#include "store/map_maker.h"
#include "temporary_folder.h"

namespace bki_mapping {
namespace {

using reference::contentOf;

bool same(const SemanticMap& a, const SemanticMap& b) {
  return contentOf(a) == contentOf(b);
}

std::string bytesOf(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream bytes;
  bytes << file.rdbuf();
  return bytes.str();
}

/// Like randomMap(), but without negative evidence, as maps of scans are.
SemanticMap drivenMap(unsigned seed, int blocks = 60, int extent = 12) {
  SemanticMap map = infoOf().emptyMap();
  const SemanticMap random = randomMap(seed, blocks, extent);
  for (const auto& [index, block] : random.entries()) {
    Block& to = map.getOrAllocate(index);
    for (std::size_t p = 0; p < block->classes().size(); ++p) {
      std::vector<EvidenceUnits> plane(block->plane(p), block->plane(p) + kBlockVoxels);
      for (EvidenceUnits& units : plane) units = units < 0 ? 0 : units / 4;
      to.add(block->classes()[p], plane.data());
    }
    to.setOcclusion(block->occlusion());
    if (to.empty()) map.erase(index);
  }
  return map;
}

class MapMerge : public testing::Test {
 protected:
  /// Writes a map of drives, which is the sum of maps by number.
  std::string make(const std::string& name, const std::string& drives) {
    const std::string path = folder_ / name;
    SemanticMap sum = infoOf().emptyMap();
    std::vector<DriveRecord> records;
    for (const char id : drives) {
      sum.add(mapOf(id));
      records.push_back(driveOf({id}));
    }
    saveMap(path, infoOf(), records, sum);
    return path;
  }
  static SemanticMap mapOf(char drive) {
    return withLooks(drivenMap(static_cast<unsigned>(drive)), static_cast<unsigned>(drive));
  }
  static SemanticMap sumOf(const std::string& drives) {
    SemanticMap sum = infoOf().emptyMap();
    for (const char id : drives) sum.add(mapOf(id));
    return sum;
  }

  MergeReport merge(const std::vector<std::string>& inputs, const std::string& output, bool keep = false,
                    const std::vector<std::string>& without = {}) {
    MergeOptions options;
    for (const std::string& input : inputs) options.inputs.push_back({input, std::nullopt});
    options.output = output;
    options.keep_drives = keep;
    options.without = without;
    return mergeMaps(options);
  }
  /// What a merge says when it is refused; nothing is written then.
  std::string refusal(const std::vector<std::string>& inputs, bool keep = false,
                      const std::vector<std::string>& without = {}) {
    const std::string output = folder_ / "refused.bkm";
    std::string text;
    try {
      merge(inputs, output, keep, without);
    } catch (const MapFileError& error) {
      text = error.what();
    } catch (const std::invalid_argument& error) {
      text = error.what();
    }
    EXPECT_FALSE(std::filesystem::exists(output));
    return text;
  }
  MergeReport move(const std::string& input, const MapPlacement& placement, const std::string& output) {
    MergeOptions options;
    options.inputs.push_back({input, placement});
    options.output = output;
    return mergeMaps(options);
  }
  static SemanticMap partOf(const std::string& path, int part) {
    MapFile file(path, MapFile::Access::kRead);
    SemanticMap map = file.info().emptyMap();
    for (const TileEntry& tile : file.tiles(part)) file.addTileTo(map, {tile.index, part});
    return map;
  }
  static std::string drivesOf(const std::string& path) {
    std::string text;
    for (const DriveRecord& drive : MapFile(path, MapFile::Access::kRead).drives()) {
      text += drive.id + std::to_string(drive.part) + " ";
    }
    return text;
  }
  static void expectHolds(const std::string& path, const std::string& drives) {
    EXPECT_TRUE(same(loadMap(path).map, sumOf(drives))) << path;
  }

  TemporaryFolder folder_;
};

TEST_F(MapMerge, AddsMapsInAnyOrder) {
  const std::string a = make("a", "a"), b = make("b", "b"), cd = make("cd", "cd");
  std::vector<std::string> inputs = {a, b, cd};
  std::string first;
  do {
    const MergeReport report = merge(inputs, folder_ / "sum");
    expectHolds(folder_ / "sum", "abcd");
    EXPECT_EQ(report.drives.size(), 4u);
    EXPECT_EQ(report.blocks, sumOf("abcd").size());
    EXPECT_EQ(report.tiles, tilesOf(sumOf("abcd")).size());
    EXPECT_EQ(report.saturated, 0u);
    if (first.empty()) first = bytesOf(folder_ / "sum");
    EXPECT_TRUE(bytesOf(folder_ / "sum") == first);
  } while (std::next_permutation(inputs.begin(), inputs.end()));
  EXPECT_EQ(drivesOf(folder_ / "sum"), "a0 b0 c0 d0 ");
}

TEST_F(MapMerge, SumsColumnsOfTilesApart) {
  MergeOptions options;
  for (const char id : {'a', 'b', 'c'}) options.inputs.push_back({make({id}, {id}), std::nullopt});
  options.output = folder_ / "columns";
  const SemanticMap whole = sumOf("abc");
  std::size_t blocks = 0;
  for (const TileColumns& columns :
       std::vector<TileColumns>{{-9, -9, -1, 9}, {0, -9, 0, -1}, {0, 0, 9, 9}, {1, -9, 9, -1}}) {
    options.columns = columns;
    const MergeReport report = mergeMaps(options);
    SemanticMap expected = infoOf().emptyMap();
    for (const auto& [index, block] : whole.entries()) {
      const GridIndex tile = Region::regionOf(index);
      if (tile.x < columns.low_x || tile.x > columns.high_x || tile.y < columns.low_y ||
          tile.y > columns.high_y)
        continue;
      Block& to = expected.getOrAllocate(index);
      for (std::size_t p = 0; p < block->classes().size(); ++p) to.add(block->classes()[p], block->plane(p));
      to.setOcclusion(block->occlusion());
      to.looks().add(block->looks());
    }
    EXPECT_TRUE(same(loadMap(options.output).map, expected));
    EXPECT_EQ(report.blocks, expected.size());
    EXPECT_EQ(report.drives.size(), 3u);
    blocks += report.blocks;
  }
  EXPECT_EQ(blocks, whole.size());
}

TEST_F(MapMerge, CountsADriveOnce) {
  const std::string a = make("a", "a"), b = make("b", "b"), ab = folder_ / "ab";
  merge({a, b}, ab);
  const std::string once = bytesOf(ab);
  EXPECT_EQ(merge({a, b, a, b}, folder_ / "c").repeated, std::vector<std::string>());
  EXPECT_TRUE(bytesOf(folder_ / "c") == once);
  std::filesystem::copy_file(a, folder_ / "copy");
  EXPECT_EQ(merge({a, folder_ / "copy", b}, folder_ / "c").repeated, std::vector<std::string>{"a"});
  EXPECT_TRUE(bytesOf(folder_ / "c") == once);
  EXPECT_EQ(merge({b, ab, a}, folder_ / "c").repeated, (std::vector<std::string>{"a", "b"}));
  EXPECT_TRUE(bytesOf(folder_ / "c") == once);
  expectHolds(folder_ / "c", "ab");
}

TEST(DriveOverlap, IdsNameScans) {
  const auto text = [](const std::string& id) {
    const auto scans = scansOf(id);
    return scans ? textOf(*scans) : "none";
  };
  EXPECT_EQ(text("04/000000-000009"), "scans 000000 to 000009 of 04");
  EXPECT_EQ(text("a/04/3-3"), "scan 000003 of a/04");
  EXPECT_EQ(text("friday#000020+20"), "scans 000020 to 000039 of friday");
  EXPECT_EQ(text("no#1/000000-000001"), "scans 000000 to 000001 of no#1");
  for (const char* other :
       {"", "04", "04/", "04/7", "04/9-3", "04/a-b", "04/1-2x", "04/-1-2", "04/1-", "d#3+0",
        "d#18446744073709551615+2", "d#99999999999999999999+1", "0ff5d2bc-7c04-4c4e-9b71-2a5c8d3e1f00"}) {
    EXPECT_EQ(text(other), "none") << other;
  }
}

/// Parts of drives, with ids and times as map_sequence gives them at 10 scans a second.
class PartsOfDrives : public MapMerge {
 protected:
  std::string part(const std::string& name, const std::string& sequence, int first, int last,
                   double start = 1.0) {
    DriveRecord drive = driveOf(id(sequence, first, last));
    drive.scans = static_cast<std::uint64_t>(last - first + 1);
    drive.first_stamp = static_cast<std::uint64_t>(1e9 * (start + 0.1 * first));
    drive.last_stamp = static_cast<std::uint64_t>(1e9 * (start + 0.1 * last));
    saveMap(folder_ / name, infoOf(), {drive}, mapOf(name[0]));
    return folder_ / name;
  }
  static std::string id(const std::string& sequence, int first, int last) {
    return sequence + "/00000" + std::to_string(first) + "-00000" + std::to_string(last);
  }
  void mergeAnyway(const std::vector<std::string>& inputs, const std::string& output) {
    MergeOptions options;
    for (const std::string& input : inputs) options.inputs.push_back({input, std::nullopt});
    options.output = output;
    options.allow_overlap = true;
    mergeMaps(options);
  }
};

TEST_F(PartsOfDrives, ScansAreNotCountedTwice) {
  const std::string a = part("a", "04", 0, 9), b = part("b", "04", 0, 4);
  EXPECT_EQ(refusal({a, b}),
            "by their ids, drive '04/000000-000004' in " + b + " and drive '04/000000-000009' in " + a +
                " share scans 000000 to 000004 of 04, which would count twice; leave one of the drives out "
                "(--without), or, if they are different scans, go on with --allow-overlap");
  EXPECT_NE(refusal({b, a}, true).find("share scans 000000 to 000004"), std::string::npos);
  EXPECT_NE(refusal({a, part("c", "04", 9, 9)}).find("share scan 000009 of 04"), std::string::npos);
  EXPECT_NE(refusal({part("d", "04", 0, 1), part("e", "04", 3, 5), part("f", "04", 5, 8)})
                .find("share scan 000005 of 04"),
            std::string::npos);
  const std::string both = folder_ / "both";
  mergeAnyway({a, b}, both);
  expectHolds(both, "ab");
  merge({both}, folder_ / "again");  // allowed once
  merge({both, a, b}, folder_ / "again");
  expectHolds(folder_ / "again", "ab");
}

TEST_F(PartsOfDrives, OtherPartsAreAdded) {
  const std::string a = part("a", "04", 0, 4), b = part("b", "04", 5, 9), c = part("c", "04", 0, 9),
                    d = part("d", "05", 0, 9), later = part("e", "04", 0, 9, 1000.0);
  merge({b, a, d}, folder_ / "sum");
  expectHolds(folder_ / "sum", "abd");
  merge({a, later}, folder_ / "sum");  // another recording in a folder of the same name
  expectHolds(folder_ / "sum", "ae");
  merge({a, b, c}, folder_ / "sum", false, {id("04", 0, 9)});
  expectHolds(folder_ / "sum", "ab");
}

TEST_F(MapMerge, RefusesToCountADriveTwice) {
  const std::string ab = make("ab", "ab"), bc = make("bc", "bc"), c = make("c", "c");
  EXPECT_EQ(refusal({ab, bc}),
            "drive 'b' is in " + ab + " in a sum with others, and in " + bc +
                ", too, so that it would count twice; make one of them without it, or make "
                "both with --keep-drives");
  // With c by itself, bc is not needed.
  merge({ab, bc, c}, folder_ / "abc");
  expectHolds(folder_ / "abc", "abc");
}

TEST_F(MapMerge, KeepsDrivesApart) {
  const std::string a = make("a", "a"), b = make("b", "b"), cd = make("cd", "cd"), kept = folder_ / "kept";
  merge({b, a, cd}, kept, true);
  EXPECT_EQ(drivesOf(kept), "a1 b2 c3 d3 ");
  expectHolds(kept, "abcd");
  EXPECT_TRUE(same(partOf(kept, 1), mapOf('a')));
  EXPECT_TRUE(same(partOf(kept, 2), mapOf('b')));
  EXPECT_TRUE(same(partOf(kept, 3), sumOf("cd")));
  const std::string bytes = bytesOf(kept);
  merge({cd, kept, a}, folder_ / "again", true);
  EXPECT_TRUE(bytesOf(folder_ / "again") == bytes);
  // A drive that is apart in one map may be in the sum of another.
  const std::string be = make("be", "be");
  merge({kept, be}, folder_ / "c");
  expectHolds(folder_ / "c", "abcde");
  merge({be, kept}, folder_ / "c", true);
  expectHolds(folder_ / "c", "abcde");
  EXPECT_EQ(drivesOf(folder_ / "c"), "a1 b2 c3 d3 e2 ");
}

TEST_F(MapMerge, TakesDrivesOut) {
  const std::string a = make("a", "a"), b = make("b", "b"), cd = make("cd", "cd"), kept = folder_ / "kept";
  merge({a, b, cd}, kept, true);
  merge({kept}, folder_ / "c", false, {"a"});
  expectHolds(folder_ / "c", "bcd");
  EXPECT_EQ(drivesOf(folder_ / "c"), "b0 c0 d0 ");
  merge({kept}, folder_ / "c", true, {"c", "d", "b"});
  merge({a}, folder_ / "d", true);
  EXPECT_TRUE(bytesOf(folder_ / "c") == bytesOf(folder_ / "d"));
  merge({kept}, folder_ / "c", false, {"a", "b", "c", "d"});
  EXPECT_EQ(loadMap(folder_ / "c").map.size(), 0u);
  EXPECT_EQ(refusal({kept, b}, false, {"c"}), "drive 'c' cannot be left out: " + kept +
                                                  " holds its evidence only in a sum with that of 'd'; leave "
                                                  "that drive out, too, or make the file with "
                                                  "--keep-drives");
  EXPECT_EQ(refusal({cd, a}, false, {"x"}), "drive 'x' is in none of the maps; they hold 'a', 'c', 'd'");
}

/// Marks and looks that several drives share cannot be told apart in a sum.
SemanticMap withoutMarks(SemanticMap map) {
  for (const auto& [index, block] : sortedBlocks(map)) {
    map.getOrAllocate(index).setOcclusion({});
    map.getOrAllocate(index).looks().clear();
    if (block->empty()) map.erase(index);
  }
  return map;
}

TEST_F(MapMerge, TakesPartsFromASumThatHoldsMore) {
  // As when a drive has been added to the sum of a file that keeps others apart.
  const std::string kept = folder_ / "kept", a = make("a", "a"), b = make("b", "b"), c = make("c", "c");
  merge({a, b}, kept, true);
  {
    MapFile file(kept, MapFile::Access::kUpdate);
    MapFile::Change change = file.change();
    const SemanticMap sum = withoutMarks(sumOf("abc"));
    for (const GridIndex& tile : tilesOf(sum)) change.writeTile(sum, {tile});
    change.putDrive(driveOf("c"));
    change.commit();
  }
  merge({kept}, folder_ / "without", true, {"a"});
  EXPECT_EQ(drivesOf(folder_ / "without"), "b1 c2 ");
  EXPECT_TRUE(same(partOf(folder_ / "without", 2), withoutMarks(mapOf('c'))));
}

TEST_F(MapMerge, TakesTheLooksOfADriveFromASumWhereItsAreStrongest) {
  const std::string path = folder_ / "sum", result = folder_ / "result";
  const auto viewed = [](std::uint64_t tick, std::initializer_list<std::pair<std::size_t, Sight>> sights) {
    SemanticMap map = infoOf().emptyMap();
    Block& block = map.getOrAllocate({{1, 2, 3}});
    block.add(40, std::vector<EvidenceUnits>(kBlockVoxels, 5).data());
    Look::Voxels of[4];
    for (const auto& [voxel, sight] : sights) of[static_cast<std::size_t>(sight)][voxel] = true;
    block.looks().add(Look(tick, of[1], of[2], of[3]));
    return map;
  };
  using S = Sight;
  const SemanticMap a = viewed(900, {{1, S::kHit}, {2, S::kCrossed}, {3, S::kVoid}, {4, S::kHit}});
  SemanticMap sum = viewed(900, {{2, S::kHit}, {3, S::kVoid}, {4, S::kCrossed}, {5, S::kCrossed}});
  sum.add(a);
  {
    NewMapFile file(path, infoOf());
    for (const auto& [id, part] : {std::pair("a", 1), std::pair("b", 0)})
      file.content().putDrive(driveOf(id, part));
    file.content().writeTile(sum, {SemanticMap::regionOf({{1, 2, 3}})});
    file.content().writeTile(a, {SemanticMap::regionOf({{1, 2, 3}}), 1});
    file.commit();
  }
  merge({path}, result, false, {"a"});
  // The other drive has seen voxels 3 and 4, too, but no less can be said of the first.
  EXPECT_TRUE(same(loadMap(result).map, viewed(900, {{2, S::kHit}, {5, S::kCrossed}})));
  merge({path}, result, true);
  EXPECT_TRUE(same(loadMap(result).map.find({{1, 2, 3}})->looks().all().empty() ? a : sum, sum));
}

TEST_F(MapMerge, TakesTheLooksOfAllCopiesOfADrive) {
  const std::string with = make("with", "a"), without = folder_ / "without";
  saveMap(without, infoOf(), {driveOf("a")}, drivenMap('a'));  // as a file of version 2 has it
  for (const auto& inputs : {std::vector{with, without}, std::vector{without, with}}) {
    merge(inputs, folder_ / "c");
    EXPECT_TRUE(bytesOf(folder_ / "c") == bytesOf(with));
  }
}

/// A map with one evidence in one voxel.
SemanticMap pointMap(EvidenceUnits units) {
  SemanticMap map = infoOf().emptyMap();
  std::vector<EvidenceUnits> plane(kBlockVoxels);
  plane[9] = units;
  map.getOrAllocate({{1, 2, 3}}).add(40, plane.data());
  return map;
}

TEST_F(MapMerge, StopsAtTheEndOfTheRange) {
  const std::string a = folder_ / "a", b = folder_ / "b", kept = folder_ / "kept";
  saveMap(a, infoOf(), {driveOf("a")}, pointMap(kMostUnits - 1));
  saveMap(b, infoOf(), {driveOf("b")}, pointMap(2));
  EXPECT_EQ(merge({a, b}, kept, true).saturated, 1u);
  EXPECT_TRUE(same(loadMap(kept).map, pointMap(kMostUnits)));
  // Sums are made of parts anew, so that what is left is exact.
  merge({kept}, folder_ / "c", false, {"a"});
  EXPECT_TRUE(same(loadMap(folder_ / "c").map, pointMap(2)));
  // What is in the sum only cannot be told from it any more.
  MapFile file(kept, MapFile::Access::kUpdate);
  MapFile::Change change = file.change();
  change.putDrive(driveOf("c"));
  change.commit();
  file = MapFile(a, MapFile::Access::kRead);
  EXPECT_NE(refusal({kept}, false, {"a"}).find("has reached its greatest value"), std::string::npos);
}

TEST_F(MapMerge, RefusesDrivesThatDiffer) {
  const std::string a = make("a", "a"), other = folder_ / "other";
  DriveRecord record = driveOf("a");
  saveMap(other, infoOf(), {record}, mapOf('x'));
  EXPECT_EQ(
      refusal({a, other}),
      "drive 'a' is not the same in " + a + " and " + other +
          ": its evidence differs, as after clearing or with other settings; leave it out of one of them "
          "first (--without)");
  record.scans = 20;
  saveMap(other, infoOf(), {record}, mapOf('a'));
  EXPECT_NE(refusal({a, other}).find("12 scans in the one and 20 in the other"), std::string::npos);
}

TEST_F(MapMerge, RefusesOtherGridsFramesAndFilesWithoutDrives) {
  const std::string a = make("a", "a"), b = folder_ / "b";
  saveMap(b, infoOf(0.25), {driveOf("b")}, infoOf(0.25).emptyMap());
  EXPECT_NE(refusal({a, b}).find("the resolution of"), std::string::npos);
  MapInfo info = infoOf();
  info.frame = "elsewhere";
  saveMap(b, info, {driveOf("b")}, mapOf('b'));
  EXPECT_NE(refusal({a, b}).find("in frame 'elsewhere'; say where"), std::string::npos) << refusal({a, b});
  MergeOptions placed;
  placed.inputs = {{b, MapPlacement()}, {a, std::nullopt}};
  placed.output = folder_ / "c";
  mergeMaps(placed);
  EXPECT_EQ(loadMap(folder_ / "c").info.frame, "a frame");
  expectHolds(folder_ / "c", "ab");
  saveMap(b, infoOf(), {}, mapOf('b'));
  EXPECT_NE(refusal({a, b}).find("does not say which drives"), std::string::npos);
  saveMap(b, infoOf(), {}, infoOf().emptyMap());
  merge({a, b}, folder_ / "c");
  expectHolds(folder_ / "c", "a");
}

TEST_F(MapMerge, KnowsNoCosts) {
  const std::string a = make("a", "a"), b = folder_ / "b", sum = folder_ / "sum";
  MapInfo costly = infoOf();
  std::vector<SemanticClass> classes = costly.classes->classes();
  classes[2].cost = 60;
  costly.classes = std::make_shared<const ClassTable>(costly.classes->name(), classes);
  saveMap(b, costly, {driveOf("a")}, mapOf('a'));
  EXPECT_TRUE(bytesOf(a) == bytesOf(b)) << "files of vehicles with other costs are the same";
  EXPECT_EQ(loadMap(b).info.classes->find(80)->cost, 0);
  checkFits(MapFile(b, MapFile::Access::kRead), costly);
  checkFits(MapFile(b, MapFile::Access::kRead), infoOf());
  saveMap(b, costly, {driveOf("b")}, mapOf('b'));
  merge({a, b}, sum);
  expectHolds(sum, "ab");
}

TEST_F(MapMerge, TakesColoursAndParametersFromTheNewestDrive) {
  const std::string a = make("a", "a"), b = folder_ / "b";
  MapInfo info = infoOf();
  info.parameters = "a: newer\n";
  DriveRecord newer = driveOf("b");
  newer.last_stamp = 1000;
  saveMap(b, info, {newer}, mapOf('b'));
  for (const auto& inputs : {std::vector{a, b}, std::vector{b, a}}) {
    merge(inputs, folder_ / "c");
    EXPECT_EQ(loadMap(folder_ / "c").info.parameters, "a: newer\n");
  }
}

TEST_F(MapMerge, ReplacesAnInput) {
  const std::string a = make("a", "a"), b = make("b", "b");
  merge({a, b}, folder_ / "c");
  merge({a, b}, b);
  EXPECT_TRUE(bytesOf(b) == bytesOf(folder_ / "c"));
  merge({b, b}, b, false);
  EXPECT_TRUE(bytesOf(b) == bytesOf(folder_ / "c"));
  EXPECT_EQ(folder_.fileCount(), 3u);
  const MapFile reader(b, MapFile::Access::kRead);
  EXPECT_THROW(merge({a}, b), MapFileInUse);
}

/// The map whose voxels take their evidence from those of another one, voxel by voxel.
SemanticMap pulled(const SemanticMap& map, const MapPlacement& placement) {
  constexpr double kPi = 3.14159265358979323846;
  const Eigen::Isometry3d pose = Eigen::Translation3d(placement.translation) *
                                 Eigen::AngleAxisd(placement.yaw * kPi / 180.0, Eigen::Vector3d::UnitZ());
  const Eigen::Isometry3d inverse = pose.inverse();
  SemanticMap result = infoOf().emptyMap();
  constexpr int kReach = 13;  // [blocks]
  for (int z = -kReach; z < kReach; ++z) {
    for (int y = -kReach; y < kReach; ++y) {
      for (int x = -kReach; x < kReach; ++x) {
        const BlockIndex index{{x, y, z}};
        Block& block = result.getOrAllocate(index);
        Block::Occlusion marks;
        std::map<ClassId, std::vector<EvidenceUnits>> planes;
        for (int v = 0; v < kBlockVoxels; ++v) {
          const Eigen::Vector3d centre = map.geometry().voxelCentre(GridGeometry::voxelOf(index, v));
          const VoxelIndex from = map.geometry().voxelAt(inverse * centre);
          const Block* source = map.find(GridGeometry::blockOf(from));
          if (!source) continue;
          const int offset = GridGeometry::offsetInBlock(from);
          marks[static_cast<std::size_t>(v)] = source->occlusion()[static_cast<std::size_t>(offset)];
          for (const ClassId id : source->classes()) {
            planes[id].resize(kBlockVoxels);
            planes[id][static_cast<std::size_t>(v)] = source->evidence(id)[offset];
          }
        }
        for (const auto& [id, plane] : planes) block.add(id, plane.data());
        block.setOcclusion(marks);
        if (block.empty()) result.erase(index);
      }
    }
  }
  return result;
}

TEST_F(MapMerge, MovesMaps) {
  const std::string a = folder_ / "a";
  const SemanticMap map = drivenMap(7, 40, 6);
  saveMap(a, infoOf(), {driveOf("a")}, map);
  for (const MapPlacement& placement :
       {MapPlacement{{0.0, 0.0, 0.0}, 90.0}, MapPlacement{{0.3, -2.1, 0.6}, 0.0},
        MapPlacement{{9.0, 7.2, -1.2}, 180.0}, MapPlacement{{-4.8, 2.4, 0.0}, -90.0},
        MapPlacement{{0.0, 0.0, 0.0}, 450.0}, MapPlacement{{1.0, 2.0, 0.1}, 0.0},
        MapPlacement{{3.3, -0.7, 0.3}, 30.0}, MapPlacement{{0.0, 0.1, 0.0}, 44.0},
        MapPlacement{{0.3, 0.0, 0.0}, 89.99}}) {
    const MergeReport report = move(a, placement, folder_ / "moved");
    const SemanticMap moved = loadMap(folder_ / "moved").map;
    const bool exact = std::fmod(placement.yaw, 90.0) == 0.0 && placement.translation.x() != 1.0;
    EXPECT_EQ(report.resampled, exact ? std::vector<std::string>() : std::vector<std::string>{a});
    ASSERT_TRUE(same(moved, pulled(map, placement)))
        << placement.translation.transpose() << " " << placement.yaw;
    const Eigen::AlignedBox3d box = loadMap(folder_ / "moved").drives[0].bounds;
    const Eigen::Vector3d corner(-1.0, 2.0, 3.0);
    const Eigen::Vector3d at =
        Eigen::AngleAxisd(placement.yaw / 180.0 * std::acos(-1.0), Eigen::Vector3d::UnitZ()) * corner +
        placement.translation;
    EXPECT_LT(box.exteriorDistance(at), 1e-9);
  }
}

TEST_F(MapMerge, MovesByWholeVoxelsAndQuarterTurnsThereAndBack) {
  const std::string a = folder_ / "a", there = folder_ / "there", back = folder_ / "back";
  DriveRecord drive = driveOf("a");
  drive.bounds = {infoOf().emptyMap().geometry().blockOrigin({{-7, 3, -1}}),
                  infoOf().emptyMap().geometry().blockOrigin({{11, 5, 13}})};
  saveMap(a, infoOf(), {drive}, randomMap(9));
  for (int turn = 0; turn < 4; ++turn) {
    for (const Eigen::Vector3i& shift : {Eigen::Vector3i(0, 0, 0), Eigen::Vector3i(1, -77, 1000)}) {
      const Eigen::Vector3d translation = 0.3 * shift.cast<double>();
      move(a, {translation, 90.0 * turn}, there);
      EXPECT_EQ(contentOf(loadMap(there).map) == contentOf(loadMap(a).map), turn == 0 && shift.isZero());
      // p = R q + t, so that q = R' p - R' t.
      const Eigen::Vector3i turned[] = {shift,
                                        {shift.y(), -shift.x(), shift.z()},
                                        {-shift.x(), -shift.y(), shift.z()},
                                        {-shift.y(), shift.x(), shift.z()}};
      const Eigen::Vector3i& t = turned[turn];
      move(there, {-0.3 * t.cast<double>(), -90.0 * turn}, back);
      EXPECT_TRUE(bytesOf(back) == bytesOf(a)) << turn << " " << shift.transpose();
    }
  }
}

TEST_F(MapMerge, MovesLooksWithTheirVoxels) {
  const std::string a = folder_ / "a", there = folder_ / "there", back = folder_ / "back";
  const SemanticMap before = withLooks(drivenMap(7, 20, 4), 7);
  saveMap(a, infoOf(), {driveOf("a")}, before);
  const double block = infoOf().emptyMap().geometry().blockSize();
  for (int turn = 0; turn < 4; ++turn) {
    move(a, {{3 * block, 0.0, -block}, 90.0 * turn}, there);
    const double cos[] = {3.0, 0.0, -3.0, 0.0}, sin[] = {0.0, 3.0, 0.0, -3.0};
    move(there, {{-cos[turn] * block, sin[turn] * block, block}, -90.0 * turn}, back);
    EXPECT_TRUE(same(loadMap(back).map, before)) << turn;
    if (turn == 0) continue;
    EXPECT_FALSE(same(loadMap(there).map, before));
  }
  // Half a block: each voxel keeps what was seen of it in the latest look of its old block.
  const MapPlacement half{{0.5 * block, 0.0, 0.0}, 0.0};
  move(a, half, there);
  const SemanticMap after = loadMap(there).map;
  const GridTransform transform(half, before.geometry().resolution());
  std::size_t seen = 0;
  for (const auto& [index, moved] : after.entries()) {
    EXPECT_TRUE(moved->looks().isCanonical());
    for (int v = 0; v < kBlockVoxels; ++v) {
      const VoxelIndex from = transform.sourceOf(GridGeometry::voxelOf(index, v));
      const Block* const source = before.find(GridGeometry::blockOf(from));
      if (!source || source->looks().empty()) continue;
      const Look latest = source->looks().all().back();
      const Sight sight = latest.at(static_cast<std::size_t>(GridGeometry::offsetInBlock(from)));
      const auto& looks = moved->looks().all();
      const auto interval = std::find_if(looks.begin(), looks.end(), [&](const Look& look) {
        return look.begin() <= latest.begin() && latest.begin() < look.begin() + look.length() &&
               look.level() == Looks::levelAt(looks.back().begin(), latest.begin());
      });
      ASSERT_TRUE(interval != looks.end());
      EXPECT_GE(interval->at(static_cast<std::size_t>(v)), sight);
      seen += sight != Sight::kNothing;
    }
  }
  EXPECT_GT(seen, 1000u);
}

TEST(GridTransform, ListsTheTilesOfEachVoxel) {
  std::mt19937 random(5);
  const auto draw = [&](double most) { return std::uniform_real_distribution<double>(-most, most)(random); };
  const auto isIn = [](const GridIndex& tile, const TileRange& range) {
    return tile.x >= range.low.x && tile.x <= range.high.x && tile.y >= range.low.y &&
           tile.y <= range.high.y && tile.z >= range.low.z && tile.z <= range.high.z;
  };
  const auto tileOf = [](const VoxelIndex& v) { return SemanticMap::regionOf(GridGeometry::blockOf(v)); };
  for (int i = 0; i < 100000; ++i) {
    MapPlacement placement{{draw(50.0), draw(50.0), draw(50.0)}, draw(400.0)};
    if (i % 3 == 0) placement = {{0.3 * (i % 130), -0.3 * (i % 77), 0.3 * (i % 300)}, 90.0 * i};
    const GridTransform transform(placement, 0.3);
    EXPECT_EQ(transform.exact(), i % 3 == 0);
    // A voxel at a corner of a tile, where a list may miss one.
    const auto coordinate = [&] { return 64 * static_cast<int>(draw(9.0)) + (draw(1.0) < 0.0 ? 0 : 63); };
    const VoxelIndex corner{{coordinate(), coordinate(), coordinate()}};
    const Eigen::Vector3d centre = GridGeometry(0.3).voxelCentre(corner);
    const Eigen::AlignedBox3d there = transform.apply(Eigen::AlignedBox3d(centre, centre));
    const VoxelIndex target = GridGeometry(0.3).voxelAt(there.min());
    const VoxelIndex source = transform.sourceOf(target);
    EXPECT_LE(std::abs(source.x - corner.x) + std::abs(source.y - corner.y) + std::abs(source.z - corner.z),
              3);
    ASSERT_TRUE(isIn(tileOf(source), transform.sourceTiles(tileOf(target)))) << i;
    ASSERT_TRUE(isIn(tileOf(target), transform.targetTiles(tileOf(source)))) << i;
    const TileRange targets = transform.targetTiles(tileOf(source));
    EXPECT_LE(targets.high.x - targets.low.x, transform.exact() ? 1 : 2);
  }
}

TEST_F(MapMerge, RefusesImpossiblePlaces) {
  const std::string a = make("a", "a");
  for (const double metres : {1e9, -1e300, std::nan("")}) {
    EXPECT_THROW(move(a, {{metres, 0.0, 0.0}, 0.0}, folder_ / "c"), std::invalid_argument) << metres;
  }
  EXPECT_THROW(move(a, {{0.0, 0.0, 0.0}, INFINITY}, folder_ / "c"), std::invalid_argument);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "c"));
}

TEST_F(MapMerge, MergesWhatIsMovedWithWhatIsNot) {
  const std::string a = folder_ / "a", b = folder_ / "b", c = folder_ / "c";
  const SemanticMap map = drivenMap(7, 40, 6);
  saveMap(a, infoOf(), {driveOf("a")}, drivenMap(8, 40, 6));
  saveMap(b, infoOf(), {driveOf("b")}, map);
  const MapPlacement placement{{0.0, 9.6, 0.0}, 90.0};
  MergeOptions options;
  options.inputs = {{a, std::nullopt}, {b, placement}};
  options.output = c;
  options.keep_drives = true;
  mergeMaps(options);
  SemanticMap sum = drivenMap(8, 40, 6);
  sum.add(pulled(map, placement));
  EXPECT_TRUE(same(loadMap(c).map, sum));
  EXPECT_TRUE(same(partOf(c, 2), pulled(map, placement)));
}

/// The most memory that a merge of two maps takes at a time [bytes], SQLite's own not counted.
std::ptrdiff_t memoryOf(const TemporaryFolder& folder, int edge,
                        const std::optional<MapPlacement>& placement) {
  std::vector<EvidenceUnits> plane(kBlockVoxels, 1);
  MergeOptions options;
  for (const char* name : {"a", "b"}) {
    NewMapFile file(folder / name, infoOf());
    file.content().putDrive(driveOf(name));
    for (int x = 0; x < edge; ++x) {
      for (int y = 0; y < edge; ++y) {
        SemanticMap tile = infoOf().emptyMap();
        const Region region({x, y, 0});
        for (int block = 0; block < Region::kBlocks; block += 8) {
          tile.getOrAllocate(region.blockIndex(block)).add(40, plane.data());
        }
        file.content().writeTile(tile, {{x, y, 0}});
      }
    }
    file.commit();
    options.inputs.push_back({folder / name, placement});
  }
  options.output = folder / "c";
  most_bytes = allocated_bytes.load();
  const std::ptrdiff_t before = allocated_bytes;
  mergeMaps(options);
  return most_bytes - before;
}

TEST_F(MapMerge, TakesNoMoreMemoryForLargerMaps) {
  const std::optional<MapPlacement> places[] = {std::nullopt, MapPlacement{{1.0, 2.0, 0.1}, 30.0}};
  for (const auto& place : places) {
    const std::ptrdiff_t small = memoryOf(folder_, 4, place), large = memoryOf(folder_, 12, place);
    EXPECT_GT(large, 0);
    // 144 tiles in place of 16, of 64 blocks with a plane of 2048 bytes each; the lists of tiles grow.
    const std::ptrdiff_t lists = 144 * 1000, maps = (144 - 16) * 64 * 2048;
    EXPECT_LT(large, small + lists);
    EXPECT_LT(lists, maps / 100);
  }
}

}  // namespace
}  // namespace bki_mapping
