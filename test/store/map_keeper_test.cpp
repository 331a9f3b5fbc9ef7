// A map that is partly in memory and partly in a file is the map that would be in memory, to the bit.
#include "bki_mapping/store/map_keeper.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <thread>

#include "store/kept_mapper.h"

namespace bki_mapping {
namespace {

using reference::contentOf;

TEST(MapKeeper, AWindowChangesNoBit) {
  const TemporaryFolder folder;
  for (const std::string mode : {"line", "uniform", "none"}) {
    const std::string path = folder / (mode + ".bkm");
    Kept kept(path, "a", configOf(mode));
    const std::vector<Scan> scans = drive();
    std::size_t most = 0;
    for (const Scan& scan : scans) {
      kept.integrate(scan);
      most = std::max(most, kept.mapper.map().size());
    }
    EXPECT_EQ(kept.keeper.close(), "");
    const auto expected = contentOfAll(scans, configOf(mode));
    EXPECT_LT(most, expected.size() / 2) << "the window left most of the map in memory";
    EXPECT_TRUE(same(contentIn(path), expected)) << mode;
    ASSERT_EQ(loadMap(path).drives.size(), 1u);
    EXPECT_EQ(loadMap(path).drives[0].scans, scans.size());
  }
}

TEST(MapKeeper, WhatComesBackIsInMemory) {
  const TemporaryFolder folder;
  Kept kept(folder / "map.bkm", "a");
  const std::vector<Scan> scans = drive();
  for (const Scan& scan : scans) kept.integrate(scan);
  const MapKeeper::Window window{scans.back().origin, kWindow};
  kept.keeper.moveTo(window);
  kept.keeper.waitForTiles();
  const auto all = contentOfAll(scans);
  std::size_t near = 0;
  for (const auto& [index, content] : all) {
    const GridGeometry& geometry = kept.mapper.map().geometry();
    const double distance = (geometry.blockCentre({index}) - window.centre).cwiseAbs().maxCoeff();
    if (distance > 0.5 * kWindow) continue;
    ++near;
    ASSERT_TRUE(kept.mapper.map().find({index}));
  }
  EXPECT_GT(near, 100u);
  for (const auto& [index, content] : contentOf(kept.mapper.map())) {
    const auto known = all.find(index);
    ASSERT_TRUE(known != all.end());
    if (((kept.mapper.map().geometry().blockCentre({index}) - window.centre).cwiseAbs().maxCoeff()) < 25.0) {
      EXPECT_TRUE(known->second == content);
    }
  }
}

TEST(MapKeeper, TellsWhichBlocksCameAndWent) {
  const TemporaryFolder folder;
  Kept kept(folder / "map.bkm", "a");
  std::set<GridIndex> shown;  // what one who follows the changes takes for the map
  const auto follow = [&](const std::vector<GridIndex>& changed) {
    for (const GridIndex& index : changed) {
      if (kept.mapper.map().find({index})) {
        shown.insert(index);
      } else {
        shown.erase(index);
      }
    }
  };
  std::size_t n = 0;
  for (const Scan& scan : drive()) {
    kept.mapper.integrate(scan);
    follow(kept.mapper.touchedBlocks());
    kept.keeper.addScan(scan.stamp);
    if (++n % 40 == 0) kept.keeper.save();
    follow(kept.keeper.moveTo({scan.origin, kWindow}));
    if (n % 10 == 0) follow(kept.keeper.waitForTiles());
    std::set<GridIndex> expected;
    for (const auto& [index, block] : kept.mapper.map().entries()) expected.insert(index);
    ASSERT_TRUE(shown == expected) << "after scan " << n;
  }
}

TEST(MapKeeper, ContinuesAMap) {
  const TemporaryFolder folder;
  const std::string path = folder / "map.bkm", copy = folder / "copy.bkm";
  const std::vector<Scan> scans = drive();
  const std::size_t pieces = 4;
  for (std::size_t piece = 0; piece < pieces; ++piece) {
    Kept kept(path, "drive " + std::to_string(piece));
    for (std::size_t i = scans.size() * piece / pieces; i < scans.size() * (piece + 1) / pieces; ++i) {
      kept.integrate(scans[i]);
      if (i % 30 == 0) kept.keeper.save();
    }
    kept.keeper.saveTo(copy).get();
  }
  EXPECT_TRUE(same(contentIn(path), contentOfAll(scans)));
  EXPECT_TRUE(same(contentIn(copy), contentOfAll(scans)));
  EXPECT_EQ(loadMap(path).drives.size(), pieces);
  EXPECT_THROW(Kept(path, "drive 2"), std::invalid_argument);
}

TEST(MapKeeper, LoadsAWholeMap) {
  const TemporaryFolder folder;
  const std::string path = folder / "map.bkm";
  std::vector<Scan> scans = drive();
  scans.resize(60);
  {
    Kept kept(path, "a");
    for (const Scan& scan : scans) kept.integrate(scan);
  }
  Kept kept(path, "b");
  kept.keeper.moveTo({});
  EXPECT_FALSE(kept.keeper.waitForTiles().empty());
  EXPECT_TRUE(same(contentOf(kept.mapper.map()), contentOfAll(scans)));
}

TEST(MapKeeper, SavedIsWhatTheFileHoldsWhateverComesThen) {
  const TemporaryFolder folder;
  const std::string path = folder / "map.bkm", killed = folder / "killed.bkm";
  const std::vector<Scan> scans = drive();
  Kept kept(path, "a");
  for (std::size_t i = 0; i < scans.size(); ++i) {
    kept.integrate(scans[i]);
    if (i != 120) continue;
    kept.keeper.save().get();
    // A copy of the file and its journal is what a killed process leaves.
    std::filesystem::copy_file(path, killed);
    EXPECT_TRUE(same(contentIn(killed), contentOfAll({scans.begin(), scans.begin() + 121})));
  }
}

TEST(MapKeeper, BringsBackWhatWasSavedBeforeItLeft) {
  const TemporaryFolder folder;
  std::vector<Scan> scans = drive();
  scans.resize(20);
  Kept kept(folder / "map.bkm", "a");
  for (const Scan& scan : scans) kept.integrate(scan, 1000.0);
  kept.keeper.save().get();
  kept.keeper.moveTo({{5000.0, 0.0, 0.0}, kWindow});
  EXPECT_EQ(kept.mapper.map().size(), 0u);
  kept.keeper.moveTo({Eigen::Vector3d::Zero(), 1000.0});
  kept.keeper.waitForTiles();
  EXPECT_TRUE(same(contentOf(kept.mapper.map()), contentOfAll(scans)));
}

TEST(MapKeeper, KeepsWithinMemory) {
  const TemporaryFolder folder;
  const std::vector<Scan> scans = drive();
  Kept plain(folder / "plain.bkm", "a"), limited(folder / "limited.bkm", "a", configOf("line", 6.0));
  for (const Scan& scan : scans) plain.integrate(scan, 1000.0);
  for (const Scan& scan : scans) {
    try {
      limited.integrate(scan, 1000.0);
    } catch (const ScanRefused&) {
      ASSERT_TRUE(limited.keeper.makeRoom());
      limited.integrate(scan, 1000.0);
    }
  }
  EXPECT_GT(plain.most_bytes, 12'000'000u);
  EXPECT_LT(limited.most_bytes, 6'000'000u);
  EXPECT_EQ(limited.keeper.close(), "");
  EXPECT_TRUE(same(contentIn(folder / "limited.bkm"), contentOfAll(scans)));
}

TEST(MapKeeper, AddsDrivesThatShareScansOnlyIfToldTo) {
  const TemporaryFolder folder;
  Kept kept(folder / "map.bkm", "04/000000-000009");
  const Scan scan = drive().front();
  kept.integrate(scan);
  SemanticMapper other(configOf(), reference::smallTable());
  other.integrate(scan);
  DriveRecord part = driveOf("04/000000-000004");
  part.scans = 1;
  part.first_stamp = part.last_stamp = scan.stamp;
  EXPECT_THROW(kept.keeper.addMap(other.snapshot().map, {part}), std::invalid_argument);
  kept.keeper.addMap(other.snapshot().map, {part}, true);
  EXPECT_THROW(kept.keeper.addMap(other.snapshot().map, {part}, true), std::invalid_argument)
      << "the same drive is no overlap";
  EXPECT_EQ(kept.keeper.close(), "");
  EXPECT_EQ(loadMap(folder / "map.bkm").drives.size(), 2u);
}

TEST(MapKeeper, AddsMapsAndForgetsThem) {
  const TemporaryFolder folder;
  const std::string path = folder / "map.bkm";
  const std::vector<Scan> scans = drive();
  const std::vector<Scan> first(scans.begin(), scans.begin() + 60), second(scans.begin() + 60, scans.end());
  const auto mapOf = [](const std::vector<Scan>& some) {
    SemanticMapper mapper(configOf(), reference::smallTable());
    for (const Scan& scan : some) mapper.integrate(scan);
    return mapper.snapshot().map;
  };
  Kept kept(path, "a");
  for (const Scan& scan : first) kept.integrate(scan);
  kept.keeper.addMap(mapOf(second), {driveOf("b")});
  EXPECT_THROW(kept.keeper.addMap(mapOf(second), {driveOf("c"), driveOf("b")}), std::invalid_argument);
  kept.keeper.save().get();
  const std::string sum = folder / "sum.bkm";
  kept.keeper.saveTo(sum).get();
  EXPECT_TRUE(same(contentIn(sum), contentOfAll(scans)));
  EXPECT_EQ(loadMap(sum).drives.size(), 2u);

  kept.keeper.reset(newDrive("d"));
  EXPECT_EQ(kept.mapper.map().size(), 0u);
  for (const Scan& scan : second) kept.integrate(scan);
  EXPECT_EQ(kept.keeper.close(), "");
  EXPECT_TRUE(same(contentIn(path), contentOfAll(second)));
  ASSERT_EQ(loadMap(path).drives.size(), 1u);
  EXPECT_EQ(loadMap(path).drives[0].id, "d");
}

TEST(MapKeeper, ClearsBoxesHereAndThere) {
  const TemporaryFolder folder;
  const std::string path = folder / "map.bkm";
  const std::vector<Scan> scans = drive();
  SemanticMapper plain(configOf(), reference::smallTable());
  Kept kept(path, "a");
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(-40.0, 220.0), size(1.0, 60.0);
  for (std::size_t i = 0; i < scans.size(); ++i) {
    plain.integrate(scans[i]);
    kept.integrate(scans[i]);
    if (i % 7 != 0) continue;  // at any moment of loading and giving away
    const Eigen::Vector3d low(place(random), place(random), -3.0);
    const Eigen::AlignedBox3d box(low, low + Eigen::Vector3d(size(random), size(random), 4.0));
    plain.clearBox(box);
    kept.keeper.clearBox(box);
  }
  EXPECT_EQ(kept.keeper.close(), "");
  EXPECT_TRUE(same(contentIn(path), contentOf(plain.map())));
}

TEST(MapKeeper, GoesOnWhenTheDiskIsFull) {
  const TemporaryFolder folder;
  const std::string path = folder / "map.bkm";
  const std::vector<Scan> scans = drive();
  {
    Kept kept(path, "a");
    std::future<void> saved;
    {
      const FullDisk full(300'000);
      for (std::size_t i = 0; i < 100; ++i) kept.integrate(scans[i]);
      saved = kept.keeper.save();
      for (int i = 0; i < 500 && kept.keeper.fault().empty(); ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
      }
      EXPECT_NE(kept.keeper.fault().find(path), std::string::npos) << kept.keeper.fault();
      EXPECT_EQ(saved.wait_for(std::chrono::seconds(0)), std::future_status::timeout);
      EXPECT_FALSE(kept.keeper.makeRoom());
    }
    saved.get();  // is tried again
    for (std::size_t i = 100; i < scans.size(); ++i) kept.integrate(scans[i]);
  }
  EXPECT_TRUE(same(contentIn(path), contentOfAll(scans)));
}

TEST(MapKeeper, SaysWhatIsLostWhenTheDiskStaysFull) {
  const TemporaryFolder folder;
  const std::string path = folder / "map.bkm";
  const std::vector<Scan> scans = drive();
  Kept kept(path, "a");
  for (std::size_t i = 0; i < 20; ++i) kept.integrate(scans[i]);
  kept.keeper.save().get();
  const FullDisk full(std::filesystem::file_size(path));
  for (std::size_t i = 20; i < 40; ++i) kept.integrate(scans[i]);
  const std::string lost = kept.keeper.close();
  EXPECT_NE(lost.find(path), std::string::npos) << lost;
  EXPECT_NE(lost.find("lost"), std::string::npos) << lost;
  EXPECT_TRUE(same(contentIn(path), contentOfAll({scans.begin(), scans.begin() + 20})));
}

TEST(MapKeeper, LeavesADamagedTileAsItIs) {
  const TemporaryFolder folder;
  const std::string path = folder / "map.bkm";
  const std::vector<Scan> scans = drive();
  const std::vector<Scan> some(scans.begin(), scans.begin() + 50);
  {
    Kept kept(path, "a");
    for (const Scan& scan : some) kept.integrate(scan);
  }
  const std::vector<GridIndex> damaged = damageATile(path);
  ASSERT_EQ(damaged.size(), 1u);
  Kept kept(path, "b");
  for (const Scan& scan : some) kept.integrate(scan);
  kept.keeper.moveTo({some.back().origin, kWindow});
  kept.keeper.waitForTiles();
  for (const Scan& scan : some) kept.integrate(scan);
  const std::string fault = kept.keeper.close();
  EXPECT_NE(fault.find("damaged"), std::string::npos) << fault;

  // All else is there three times, and the tile is as it was.
  std::vector<Scan> thrice = some;
  thrice.insert(thrice.end(), some.begin(), some.end());
  thrice.insert(thrice.end(), some.begin(), some.end());
  const auto all = contentOfAll(thrice);
  MapFile file(path, MapFile::Access::kRead);
  SemanticMap rest = file.info().emptyMap();
  std::size_t unread = 0;
  for (const TileEntry& tile : file.tiles()) {
    if (tile.index == damaged[0]) {
      EXPECT_THROW(file.addTileTo(rest, {tile.index}), MapFileDamaged);
      ++unread;
    } else {
      file.addTileTo(rest, {tile.index});
    }
  }
  EXPECT_EQ(unread, 1u);
  auto expected = all;
  for (auto entry = expected.begin(); entry != expected.end();) {
    entry = SemanticMap::regionOf({entry->first}) == damaged[0] ? expected.erase(entry) : std::next(entry);
  }
  EXPECT_TRUE(same(contentOf(rest), expected));
}

}  // namespace
}  // namespace bki_mapping
