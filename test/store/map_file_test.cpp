// Map files: what is written is read again, to the bit, tile by tile.
#include "bki_mapping/store/map_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>

#include "reference/content.h"
#include "refusal_of.h"
#include "store/map_maker.h"
#include "temporary_folder.h"

namespace bki_mapping {
namespace {

using reference::contentOf;

TEST(MapFile, HoldsAWholeMap) {
  const TemporaryFolder folder;
  const std::string path = folder / "map.bkm";
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const SemanticMap map = withLooks(randomMap(seed), seed);
    saveMap(path, infoOf(), {driveOf("b"), driveOf("a", 3)}, map);
    const StoredMap stored = loadMap(path);
    EXPECT_EQ(contentOf(stored.map), contentOf(map));
    ASSERT_EQ(stored.drives.size(), 2u);
    EXPECT_EQ(stored.drives[0], driveOf("a"));  // parts are not read, and not written
    EXPECT_EQ(stored.drives[1], driveOf("b"));
  }
}

TEST(MapFile, HoldsWhatTheMapIsAbout) {
  const TemporaryFolder folder;
  const std::string path = folder / "map.bkm";
  const MapInfo info = infoOf();
  saveMap(path, info, {}, info.emptyMap());
  const MapInfo stored = loadMap(path).info;
  EXPECT_EQ(stored.resolution, info.resolution);
  EXPECT_EQ(stored.prior, info.prior);
  EXPECT_EQ(stored.frame, info.frame);
  EXPECT_EQ(stored.parameters, info.parameters);
  EXPECT_EQ(stored.program.rfind("bki_mapping ", 0), 0u) << stored.program;
  EXPECT_EQ(stored.classes->name(), "a table");
  ASSERT_EQ(stored.classes->size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    const SemanticClass &c = stored.classes->classes()[i], &given = info.classes->classes()[i];
    EXPECT_EQ(c.id, given.id);
    EXPECT_EQ(c.name, given.name);
    EXPECT_EQ(c.color, given.color);
    EXPECT_EQ(c.raw, given.raw);
    EXPECT_EQ(c.any_raw, given.any_raw);
    EXPECT_EQ(c.unlabelled, given.unlabelled);
    EXPECT_EQ(c.dynamic, given.dynamic);
    EXPECT_EQ(c.living, given.living);
    EXPECT_EQ(c.ground, given.ground);
    EXPECT_EQ(c.ignored, given.ignored);
    EXPECT_EQ(c.free_gain, given.free_gain);
  }
}

TEST(MapFile, AddsToAMapAsMapsAreAdded) {
  const TemporaryFolder folder;
  const std::string path = folder / "map.bkm";
  const SemanticMap stored = withLooks(randomMap(1), 1);
  saveMap(path, infoOf(), {}, stored);
  SemanticMap sum = withLooks(randomMap(2), 2), expected = withLooks(randomMap(2), 2);
  expected.add(stored);
  MapFile file(path, MapFile::Access::kRead);
  for (const TileEntry& tile : file.tiles()) EXPECT_TRUE(file.addTileTo(sum, {tile.index}));
  EXPECT_EQ(contentOf(sum), contentOf(expected));
  EXPECT_FALSE(file.addTileTo(sum, {{1000, 0, 0}}));
}

TEST(MapFile, ReadsTheTilesOfABoxOnly) {
  const TemporaryFolder folder;
  const std::string path = folder / "map.bkm";
  saveMap(path, infoOf(), {}, randomMap(3, 300, 40));
  MapFile file(path, MapFile::Access::kRead);
  const GridIndex low{-2, 0, -1}, high{3, 4, 0};
  std::vector<TileEntry> expected;
  for (const TileEntry& tile : file.tiles()) {
    const GridIndex& i = tile.index;
    if (i.x >= low.x && i.x <= high.x && i.y >= low.y && i.y <= high.y && i.z >= low.z && i.z <= high.z) {
      expected.push_back(tile);
    }
  }
  ASSERT_GT(expected.size(), 5u);
  ASSERT_LT(expected.size(), file.tiles().size());
  EXPECT_TRUE(file.tilesIn(low, high) == expected);
}

TEST(MapFile, ChangesTileByTile) {
  const TemporaryFolder folder;
  const std::string path = folder / "map.bkm";
  const SemanticMap before = randomMap(4), after = randomMap(5);
  saveMap(path, infoOf(), {driveOf("a")}, before);
  {
    MapFile file(path, MapFile::Access::kUpdate);
    {
      MapFile::Change lost = file.change();
      for (const GridIndex& tile : tilesOf(after)) lost.writeTile(after, {tile});
      lost.eraseDrive("a");
    }
    EXPECT_EQ(file.drives().size(), 1u);
    MapFile::Change change = file.change();
    for (const GridIndex& tile : tilesOf(before)) change.eraseTile({tile});
    for (const GridIndex& tile : tilesOf(after)) change.writeTile(after, {tile});
    for (const GridIndex& tile : tilesOf(before)) change.writeTile(before, {tile, 7});
    change.putDrive(driveOf("b", 7));
    change.putDrive(driveOf("a"));
    change.commit();
  }
  MapFile file(path, MapFile::Access::kRead);
  SemanticMap part = infoOf().emptyMap();
  for (const TileEntry& tile : file.tiles(7)) file.addTileTo(part, {tile.index, 7});
  EXPECT_EQ(contentOf(part), contentOf(before));
  EXPECT_EQ(contentOf(readMap(file).map), contentOf(after));
  EXPECT_EQ(file.drives().size(), 2u);
}

TEST(MapFile, IsUpdatedByOneAlone) {
  const TemporaryFolder folder;
  const std::string path = folder / "map.bkm";
  MapFile first = MapFile::create(path, infoOf());
  for (const auto access : {MapFile::Access::kRead, MapFile::Access::kUpdate}) {
    EXPECT_THROW(MapFile(path, access), MapFileInUse);
  }
  EXPECT_THROW(saveMap(path, infoOf(), {}, randomMap(1)), MapFileInUse);
  EXPECT_NE(sentenceOf([&] { MapFile::create(path, infoOf()); }), "");
  first.change().commit();
  first = MapFile::create(folder / "other.bkm", infoOf());
  const MapFile reader(path, MapFile::Access::kRead), second_reader(path, MapFile::Access::kRead);
  EXPECT_THROW(MapFile(path, MapFile::Access::kUpdate), MapFileInUse);
}

TEST(MapFile, RefusesWhatExceedsTheLimitOfMemory) {
  const TemporaryFolder folder;
  const std::string path = folder / "map.bkm";
  const SemanticMap map = withLooks(randomMap(6), 6);
  saveMap(path, infoOf(), {}, map);
  EXPECT_NO_THROW(loadMap(path, map.bytes()));
  const auto isRefused = [&](std::size_t limit) {
    return sentenceOf([&] { loadMap(path, limit); }).find("raise the limit") != std::string::npos;
  };
  EXPECT_TRUE(isRefused(map.bytes() / 2));
  std::size_t without_looks = 0;
  for (const TileEntry& tile : MapFile(path, MapFile::Access::kRead).tiles()) without_looks += memoryOf(tile);
  EXPECT_TRUE(isRefused(without_looks + 10'000));
}

TEST(MapFile, RefusesOtherFiles) {
  const TemporaryFolder folder;
  const auto fault = [&](const std::string& path) {
    return sentenceOf([&] { MapFile(path, MapFile::Access::kRead); });
  };
  const std::string path = folder / "map.bkm";
  EXPECT_NE(fault(path).find("cannot be opened"), std::string::npos) << fault(path);
  std::ofstream(path) << std::string(5000, 'x');
  EXPECT_EQ(fault(path),
            path + " is not a map of bki_mapping, although its name ends in .bkm; use another copy of it");
  std::filesystem::resize_file(path, 50);  // less than a header
  EXPECT_EQ(fault(path),
            path + " is not a map of bki_mapping, although its name ends in .bkm; use another copy of it");
  std::filesystem::resize_file(path, 0);
  EXPECT_EQ(fault(path), path + " is empty; use another copy of it, or make the map again");
  std::filesystem::rename(path, folder / "map.ply");
  EXPECT_EQ(fault(folder / "map.ply"), (folder / "map.ply") + " is empty; give the name of a .bkm file");
  std::ofstream(folder / "map.ply") << std::string(5000, 'x');
  EXPECT_EQ(fault(folder / "map.ply"),
            (folder / "map.ply") + " is not a map of bki_mapping; give the name of a .bkm file");
  EXPECT_NE(fault("/dev/null").find("not a regular file"), std::string::npos) << fault("/dev/null");
  // Somebody else's file is replaced, as by any program that saves.
  saveMap(path, infoOf(), {}, randomMap(1));
  EXPECT_EQ(fault(path), "");
}

TEST(MapInfo, SaysWhyMapsCannotBeAdded) {
  const auto fault = [](const MapInfo& a, const MapInfo& b) {
    return refusalOf([&] { checkSameGrid("A", a, "B", b); });
  };
  EXPECT_EQ(fault(infoOf(), infoOf()), "");
  EXPECT_EQ(fault(infoOf(0.25), infoOf(0.5)),
            "the resolution of A is 0.25 and that of B is 0.5; maps can only be added if they agree");
  EXPECT_EQ(fault(infoOf(0.1), infoOf(0.3)),
            "the resolution of A is 0.1 and that of B is 0.3; maps can only be added if they agree");
  EXPECT_EQ(
      fault(infoOf(0.1), infoOf(std::nextafter(0.1, 1.0))),
      "the resolution of A is 0.10000000000000001 and that of B is 0.10000000000000002; maps can only be "
      "added if they agree");
  MapInfo other = infoOf();
  std::vector<SemanticClass> classes = other.classes->classes();
  classes[1].color = {9, 9, 9};
  other.classes = std::make_shared<ClassTable>("another name", classes);
  EXPECT_EQ(fault(infoOf(), other), "");
  classes[1].name = "tram";
  other.classes = std::make_shared<ClassTable>("a table", classes);
  EXPECT_EQ(fault(infoOf(), other),
            "class 1 of A is 40 'class 1' and that of B is 40 'tram'; maps can only be added if they agree");
}

}  // namespace
}  // namespace bki_mapping
