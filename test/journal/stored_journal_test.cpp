// A journal that was written to a map file corrects the map as one in memory does: to the bit.
#include "journal/stored_journal.h"

#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "bki_mapping/store/map_merge.h"
#include "bki_mapping/store/mapper_file.h"
#include "journal/file_correction.h"
#include "journal/random_motion.h"
#include "journal/scan_codec.h"
#include "journal/stored_settings.h"
#include "reference/content.h"
#include "reference/scenes.h"
#include "store/map_maker.h"
#include "temporary_folder.h"

namespace bki_mapping {
namespace {

using Content = std::map<GridIndex, std::string>;

MapperConfig ruled(bool looks) {
  MapperConfig config;
  config.free_space.mode = "line";
  config.rules.enabled = true;
  config.rules.latest = looks;
  config.sensor_model.height = 1.5;
  config.threads = 1;
  return config;
}

/// Settings that a drive may begin with after others, and of which the second is a change while mapping.
std::vector<MapperConfig> manySettings(bool looks) {
  std::vector<MapperConfig> settings(3, ruled(looks));
  settings[1].sensor_model.max_range = 3.0;
  settings[2].downsample_resolution = 0.15;
  return settings;
}

/// A map of scans, with all that its file needs; what is in it is made afresh for each use.
class Drives {
 public:
  struct Entry {
    SensorScan scan;
    std::string drive, sensor;
    int settings = 0, cleared = 0;
    bool jump = false;
    Eigen::Isometry3d pose, odometry;
  };

  explicit Drives(std::vector<MapperConfig> settings) : settings_(std::move(settings)) {}

  /// Adds a scan from a random place, some of whose points are near others of earlier scans.
  Entry& add(const std::string& drive, int settings, std::mt19937& random) {
    Eigen::Isometry3d pose = randomMotion(random, 1.5, 3.0);
    pose.translation().z() *= 0.2;
    Scan scan = roomScan(pose, 0, random);
    scan.stamp = stamp_ += 70'000'000 + random() % 300'000'000;
    const MapperConfig& config = settings_[static_cast<std::size_t>(settings)];
    RoundedScan rounded = toSensorScan(scan, pose, 0.01, config.sensor_model);
    entries_.push_back({std::move(rounded.scan), drive, random() % 2 ? "left" : "right", settings,
                        static_cast<int>(boxes_.size()), false, rounded.T_map_sensor,
                        randomMotion(random, 3.0, 1.0)});
    return entries_.back();
  }
  void clear(const Eigen::AlignedBox3d& box) { boxes_.push_back(box); }

  /// The map of the scans, and their rows.
  SemanticMap map(std::vector<ScanRecord>* rows = nullptr, std::vector<DriveRecord>* drives = nullptr) const {
    SemanticMap sum = SemanticMapper(settings_[0], table_).takeMap();
    std::size_t cleared = 0;
    for (std::size_t n = 0; n < entries_.size(); ++n) {
      const Entry& entry = entries_[n];
      for (; cleared < static_cast<std::size_t>(entry.cleared); ++cleared) clearBox(sum, boxes_[cleared]);
      SemanticMapper mapper(settings_[static_cast<std::size_t>(entry.settings)], table_);
      mapper.addMap(std::move(sum));
      mapper.integrate(place(entry.scan, entry.pose));
      if (rows) rows->push_back(rowOfEntry(n, mapper.touchedBlocks()));
      if (drives) note(entry, mapper, *drives);
      sum = mapper.takeMap();
    }
    for (; cleared < boxes_.size(); ++cleared) clearBox(sum, boxes_[cleared]);
    return sum;
  }

  void save(const std::string& path) const {
    std::vector<ScanRecord> rows;
    std::vector<DriveRecord> drives;
    const SemanticMap sum = map(&rows, &drives);
    NewMapFile file(path, mapInfoOf(SemanticMapper(settings_[0], table_), "map"));
    for (const DriveRecord& drive : drives) file.content().putDrive(drive);
    for (const GridIndex& tile : tilesOf(sum)) file.content().writeTile(sum, {tile});
    for (const MapperConfig& config : settings_)
      file.content().addSettings(settingsText(config, table_of_settings_ ? *table_of_settings_ : *table_));
    for (const Eigen::AlignedBox3d& box : boxes_) file.content().addClearedBox(box);
    for (std::size_t n = 0; n < rows.size(); ++n) {
      file.content().addScan(rows[n], packScan(entries_[n].scan));
    }
    file.commit();
  }

  std::shared_ptr<const ClassTable> table_ = reference::tableWithDynamicClass();
  std::shared_ptr<const ClassTable> table_of_settings_ = nullptr;  ///< nullptr: the same
  std::vector<MapperConfig> settings_;
  std::vector<Entry> entries_;
  std::vector<Eigen::AlignedBox3d> boxes_;

 private:
  ScanRecord rowOfEntry(std::size_t n, const std::vector<GridIndex>& touched) const {
    const Entry& entry = entries_[n];
    ScanRecord row;
    row.number = 3 * n + 2;  // numbers may have gaps
    row.drive = entry.drive;
    row.stamp = entry.scan.stamp;
    row.sensor = entry.sensor;
    row.settings = entry.settings;
    row.cleared = entry.cleared;
    row.jump = entry.jump;
    row.reach = reachOf(entry.scan, settings_[static_cast<std::size_t>(entry.settings)].sensor_model);
    row.T_map_sensor = entry.pose;
    row.T_odometry_sensor = entry.odometry;
    row.tiles = regionsOf(touched);
    return row;
  }
  static void note(const Entry& entry, const SemanticMapper& mapper, std::vector<DriveRecord>& drives) {
    auto drive = std::find_if(drives.begin(), drives.end(),
                              [&](const DriveRecord& each) { return each.id == entry.drive; });
    if (drive == drives.end()) {
      drive = drives.emplace(drives.end());
      drive->id = entry.drive;
    }
    drive->addScan(entry.scan.stamp, mapper.map().geometry(), mapper.touchedBlocks());
  }

  std::uint64_t stamp_ = 1'000'000'000;
};

/// A map file in memory with its journal.
class Restored {
 public:
  explicit Restored(MapFile& file)
      : map_(readMap(file).map),
        corrector_(*journalSettings(file).front(), file.info().classes, exactSettings(),
                   {[this](const SemanticMap& difference) {
                      map_.add(difference);
                      for (const GridIndex& region : difference.regions()) changed_.insert(region);
                      return std::vector<GridIndex>();
                    },
                    [this](const GridIndex& region, const LooksByBlock& looks) {
                      changed_.insert(region);
                      return replaceLooks(map_, region, looks);
                    }}),
        rows_(restoreJournal(file, corrector_)) {}

  void moveTo(const std::vector<Eigen::Isometry3d>& poses) {
    corrector_.correctTo(poses);
    corrector_.finish(Eigen::Vector3d::Zero());
    const MapCorrector::Progress progress = corrector_.progress();
    EXPECT_EQ(progress.failed, 0u) << progress.fault;
    EXPECT_EQ(progress.fault, "");
  }
  Content content() const { return reference::contentOf(map_); }
  /// Writes what has changed.
  void save(MapFile& file) {
    MapFile::Change change = file.change();
    for (const GridIndex& tile : changed_) change.writeTile(map_, {tile});
    for (std::size_t n = 0; n < rows_.size(); ++n) {
      change.moveScan(recordOf(corrector_.journal().at(n), rows_[n]));
    }
    change.commit();
  }

  SemanticMap map_;
  std::set<GridIndex> changed_;
  MapCorrector corrector_;
  std::vector<StoredAs> rows_;
};

std::vector<Eigen::Isometry3d> posesOf(const Drives& drives) {
  std::vector<Eigen::Isometry3d> poses;
  for (const Drives::Entry& entry : drives.entries_) poses.push_back(entry.pose);
  return poses;
}

/// Moves some scans. @param drive whose scans move; "": all.
std::vector<Eigen::Isometry3d> moveSome(Drives& drives, const std::string& drive, std::mt19937& random) {
  for (Drives::Entry& entry : drives.entries_) {
    if (random() % 4 == 0 || (!drive.empty() && entry.drive != drive)) continue;
    entry.pose = roundedPose(randomMotion(random, 0.6, 0.1) * entry.pose);
  }
  return posesOf(drives);
}

/// Two drives with changing settings.
Drives twoDrives(bool looks, std::mt19937& random, const std::vector<Eigen::AlignedBox3d>& boxes = {}) {
  Drives drives(manySettings(looks));
  for (int n = 0; n < 8; ++n) {
    if (n == 3) {
      for (const Eigen::AlignedBox3d& box : boxes) drives.clear(box);
    }
    drives.add("first", n < 5 ? 0 : 1, random);
  }
  for (int n = 0; n < 8; ++n) {
    drives.add("second", 2, random);
    if (n == 4) {
      for (const Eigen::AlignedBox3d& box : boxes) drives.clear(box);
    }
  }
  return drives;
}

class StoredJournal : public testing::Test {
 protected:
  TemporaryFolder folder_;
  const std::string path_ = folder_ / "map.bkm";
};

TEST_F(StoredJournal, CorrectsAMapAcrossDrivesAndSettings) {
  for (const bool looks : {true, false}) {
    std::mt19937 random(looks ? 31 : 32);
    Drives drives = twoDrives(looks, random);
    drives.save(path_);
    const Content before = reference::contentOf(drives.map());
    for (const std::string moved : {"second", "first", ""}) {
      MapFile file(path_, MapFile::Access::kUpdate);
      Restored restored(file);
      ASSERT_TRUE(restored.content() == reference::contentOf(drives.map()));
      ASSERT_EQ(restored.rows_.size(), drives.entries_.size());
      EXPECT_TRUE(restored.corrector_.journal().foreign().empty());
      restored.moveTo(moveSome(drives, moved, random));
      EXPECT_GT(restored.corrector_.progress().moved, 3u);
      ASSERT_TRUE(restored.content() == reference::contentOf(drives.map())) << moved;
      ASSERT_FALSE(restored.content() == before);
      restored.save(file);
      EXPECT_TRUE(reference::contentOf(readMap(file).map) == restored.content());
    }
  }
}

TEST_F(StoredJournal, RemembersTheRows) {
  std::mt19937 random(33);
  Drives drives = twoDrives(true, random);
  drives.entries_[4].jump = true;
  drives.save(path_);
  MapFile file(path_, MapFile::Access::kUpdate);
  const std::vector<ScanRecord> rows = file.scans();
  Restored restored(file);
  std::map<std::size_t, std::string> sensors;  // their names, by the numbers that scans have
  for (std::size_t n = 0; n < rows.size(); ++n) {
    const JournalScan& scan = restored.corrector_.journal().at(n);
    const ScanRecord row = recordOf(scan, restored.rows_[n]);
    EXPECT_EQ(row.number, rows[n].number);
    EXPECT_EQ(row.drive, rows[n].drive);
    EXPECT_EQ(row.stamp, rows[n].stamp);
    EXPECT_EQ(row.sensor, rows[n].sensor);
    EXPECT_EQ(sensors.emplace(scan.sensor, row.sensor).first->second, row.sensor);
    EXPECT_EQ(row.settings, rows[n].settings);
    EXPECT_EQ(row.cleared, rows[n].cleared);
    EXPECT_EQ(row.jump, rows[n].jump);
    EXPECT_EQ(row.reach, rows[n].reach);
    EXPECT_EQ(row.T_map_sensor.matrix(), rows[n].T_map_sensor.matrix());
    EXPECT_EQ(row.T_odometry_sensor.matrix(), rows[n].T_odometry_sensor.matrix());
    EXPECT_EQ(row.tiles, rows[n].tiles);
    EXPECT_TRUE(unpackScan(*scan.packed) == drives.entries_[n].scan);
  }
  EXPECT_EQ(sensors.size(), 2u);
}

/// Without looks, whose intervals may differ from those of a map made afresh where a box was cleared.
TEST_F(StoredJournal, WhatWasClearedStaysEmptyOfWhatWasBefore) {
  std::mt19937 random(34);
  const Eigen::AlignedBox3d box(Eigen::Vector3d(-1.0, -3.0, -3.0), Eigen::Vector3d(2.0, 3.0, 3.0));
  Drives drives = twoDrives(false, random, {box});
  drives.save(path_);
  MapFile file(path_, MapFile::Access::kRead);
  EXPECT_EQ(file.clearedBoxes().size(), 2u);
  Restored restored(file);
  restored.moveTo(moveSome(drives, "", random));
  EXPECT_TRUE(restored.content() == reference::contentOf(drives.map()));
}

TEST_F(StoredJournal, TilesOfScansThatItLacksAreForeign) {
  std::mt19937 random(36);
  Drives drives = twoDrives(true, random);
  drives.save(path_);
  MapFile file(path_, MapFile::Access::kUpdate);
  const std::vector<TileEntry> tiles = file.tiles();
  ASSERT_GT(tiles.size(), 4u);
  const double edge = 64 * file.info().resolution;
  DriveRecord lacking;
  lacking.id = "of another map";
  lacking.scans = 1;
  const GridIndex& in = tiles.front().index;
  const Eigen::Vector3d corner = edge * Eigen::Vector3d(in.x, in.y, in.z);
  lacking.bounds = {corner, corner + Eigen::Vector3d::Constant(edge)};
  MapFile::Change change = file.change();
  change.putDrive(lacking);
  change.commit();
  EXPECT_EQ(Restored(file).corrector_.journal().foreign(), std::set<GridIndex>{in});

  MapFile::Change emptied = file.change();
  lacking.scans = 0;
  emptied.putDrive(lacking);
  emptied.commit();
  EXPECT_TRUE(Restored(file).corrector_.journal().foreign().empty());
}

/// A path that ends before a jump moves nothing after it.
TEST_F(StoredJournal, KeepsJumps) {
  std::mt19937 random(37);
  Drives drives(manySettings(true));
  for (int n = 0; n < 6; ++n) {
    Drives::Entry& entry = drives.add("only", 0, random);
    entry.sensor = "";
    entry.odometry = entry.pose;
    entry.jump = n == 3;
  }
  drives.save(path_);
  MapFile file(path_, MapFile::Access::kRead);
  Restored restored(file);
  const Eigen::Isometry3d shift = randomMotion(random, 0.5, 0.0);
  EXPECT_TRUE(restored.corrector_.correct({{drives.entries_[1].scan.stamp, shift * drives.entries_[1].pose}},
                                          {Eigen::Isometry3d::Identity()}));
  restored.corrector_.finish(Eigen::Vector3d::Zero());
  EXPECT_EQ(restored.corrector_.progress().moved, 3u);
  for (std::size_t n = 0; n < 3; ++n) {
    drives.entries_[n].pose = roundedPose(shift * drives.entries_[n].pose);
  }
  EXPECT_TRUE(restored.content() == reference::contentOf(drives.map()));
}

TEST_F(StoredJournal, SettingsThatCannotBeUsedAreNamed) {
  std::mt19937 random(38);
  for (const auto& [settings, words] : std::vector<std::pair<std::string, std::string>>{
           {"a_setting_of_the_future: 1\n", "a_setting_of_the_future"},
           {"rules: {hit_outweighs: 20}\n", "rules/hit_outweighs is no longer one"},
           {"resolution: -1\n", "resolution is"},
           {"resolution: 0.5\n", "resolution is 0.5, and that of the map 0.3"},
           {"free_space: {mode: lines}\n", "did you mean 'line'?"},
           {"[", "a key must be plain text"}}) {
    twoDrives(true, random).save(path_);
    MapFile file(path_, MapFile::Access::kUpdate);
    MapFile::Change change = file.change();
    change.addSettings(settings);
    change.commit();
    const std::string refusal = sentenceOf([&] { FileCorrection(file, 0.0); });
    EXPECT_EQ(refusal.rfind("the settings in the journal of " + path_, 0), 0u) << refusal;
    EXPECT_NE(refusal.find(words), std::string::npos) << refusal;
  }
}

/// The poses of a drive's scans.
std::vector<Eigen::Isometry3d> posesOf(const Drives& drives, const std::string& drive) {
  std::vector<Eigen::Isometry3d> poses;
  for (const Drives::Entry& entry : drives.entries_) {
    if (entry.drive == drive) poses.push_back(entry.pose);
  }
  return poses;
}

/// What a map holds but its looks.
std::map<GridIndex, std::vector<EvidenceUnits>> evidenceOf(const SemanticMap& map) {
  std::map<GridIndex, std::vector<EvidenceUnits>> planes;
  for (const auto& [index, block] : map.entries()) {
    planes[index].assign(block->plane(0), block->plane(0) + block->classes().size() * kBlockVoxels);
  }
  return planes;
}

/// Merges two maps, whatever their order, and corrects drives of the result.
void correctMerged(const std::vector<Eigen::AlignedBox3d>& boxes, std::mt19937& random) {
  const TemporaryFolder folder;
  const std::string left = folder / "left.bkm", right = folder / "right.bkm", merged = folder / "merged.bkm",
                    expected = folder / "expected.bkm";
  Drives two = twoDrives(true, random, boxes), third({manySettings(true)[2], manySettings(true)[0]});
  for (int n = 0; n < 5; ++n) third.add("third", n % 2, random);
  two.save(left);
  third.save(right);
  const auto merge = [&](const std::string& output, bool reverse = false) {
    MergeOptions options;
    options.inputs = {{left, std::nullopt}, {right, MapPlacement()}};
    if (reverse) std::swap(options.inputs[0], options.inputs[1]);
    options.output = output;
    EXPECT_EQ(mergeMaps(options).without_journal, std::vector<std::string>());
  };
  const auto rowsOf = [](const std::string& path) {
    MapFile file(path, MapFile::Access::kRead);
    std::vector<std::string> rows = file.settings();
    for (const ScanRecord& scan : file.scans()) {
      rows.push_back(scan.drive + " " + std::to_string(scan.number) + " " + std::to_string(scan.stamp) + " " +
                     std::to_string(scan.settings) + " " + std::to_string(scan.cleared) +
                     file.scanContent(scan.number));
    }
    return rows;
  };
  merge(merged);
  merge(expected, true);
  EXPECT_EQ(rowsOf(merged).size(), 3u + 16u + 5u);
  EXPECT_TRUE(rowsOf(merged) == rowsOf(expected)) << "whatever the order";
  for (const std::string drive : {"third", "first", "second"}) {
    Drives& of_drive = drive == "third" ? third : two;
    moveSome(of_drive, drive, random);
    two.save(left);
    third.save(right);
    merge(expected);
    MapFile file(merged, MapFile::Access::kUpdate);
    FileCorrection correction(file, 0.0);
    correction.move(drive, posesOf(of_drive, drive));
    EXPECT_GT(correction.moved(), 1u);
    MapFile::Change change = file.change();
    correction.write(change, drive, false);
    change.commit();
    MapFile wanted(expected, MapFile::Access::kRead);
    const SemanticMap found = readMap(file).map, map = readMap(wanted).map;
    ASSERT_TRUE(evidenceOf(found) == evidenceOf(map)) << drive;
    if (!boxes.empty()) continue;  // intervals of looks may differ (map_corrector.h)
    EXPECT_TRUE(reference::contentOf(found) == reference::contentOf(map)) << drive;
  }
}

TEST_F(StoredJournal, ADriveIsCorrectedInAMergedMapAsBefore) {
  std::mt19937 random(39);
  correctMerged({}, random);
  correctMerged({{Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(1.5, 1, 1)}}, random);
}

TEST_F(StoredJournal, WhatAMergedMapCannotHaveIsSaid) {
  const std::string left = folder_ / "left.bkm", right = folder_ / "right.bkm",
                    merged = folder_ / "merged.bkm";
  std::mt19937 random(40);
  const Eigen::AlignedBox3d box(Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(1.5, 1, 1));
  twoDrives(true, random, {box}).save(left);
  Drives third(manySettings(true));
  for (int n = 0; n < 5; ++n) third.add("third", 0, random);
  third.save(right);
  const auto merge = [&](const std::function<void(MergeOptions&)>& change) {
    MergeOptions options;
    options.inputs = {{left, std::nullopt}, {right, std::nullopt}};
    options.output = merged;
    change(options);
    const std::vector<std::string> said = mergeMaps(options).without_journal;
    return std::pair(said, MapFile(merged, MapFile::Access::kRead).scans().size());
  };
  const auto sentence = [](const std::string& path, const std::string& why) {
    return path + " has scans in its journal, which the merged map does not have, because " + why +
           "; correct their poses before you merge";
  };
  using Said = std::pair<std::vector<std::string>, std::size_t>;
  EXPECT_EQ(merge([](MergeOptions& o) {
              o.inputs[1].placement = MapPlacement{{0.3, 0.0, 0.0}, 0.0};
            }),
            Said({sentence(right, "it is moved by --transform")}, 16u));
  EXPECT_EQ(merge([](MergeOptions& o) { o.without = {"third"}; }), Said({}, 16u));
  for (const auto& [change, why] : std::vector<std::pair<std::function<void(MergeOptions&)>, std::string>>{
           {[](MergeOptions& o) { o.keep_drives = true; }, "--keep-drives stores drives separately"},
           {[](MergeOptions& o) {
              o.columns = TileColumns{-1, -1, 0, 0};
            },
            "--tiles leaves out some of their evidence"}}) {
    EXPECT_EQ(merge(change), Said({sentence(left, why), sentence(right, why)}, 0u));
  }
  third.clear(box);
  third.save(right);
  const std::string why = "boxes were cleared in several maps";
  EXPECT_EQ(merge([](MergeOptions&) {}), Said({sentence(left, why), sentence(right, why)}, 0u));
}

/// The class table of the file, with a class changed.
std::shared_ptr<const ClassTable> changedTable(const std::function<void(SemanticClass&)>& change) {
  std::vector<SemanticClass> classes = reference::tableWithDynamicClass()->classes();
  change(classes[2]);
  return std::make_shared<ClassTable>("dynamic", classes);
}

TEST_F(StoredJournal, KnowsFlagsOfClassesThatFilesDoNotStore) {
  std::mt19937 random(40);
  Drives drives(manySettings(true));
  drives.table_ = changedTable([](SemanticClass& c) { c.airborne = true; });
  for (int n = 0; n < 4; ++n) drives.add("only", 0, random);
  drives.save(path_);
  const Content before = reference::contentOf(drives.map());
  MapFile file(path_, MapFile::Access::kUpdate);
  EXPECT_FALSE(file.info().classes->find(2)->airborne);
  EXPECT_TRUE(journalClasses(file)->find(2)->airborne);
  FileCorrection correction(file, 0.0);
  EXPECT_EQ(correction.move("only", moveSome(drives, "", random)), "");
  MapFile::Change change = file.change();
  correction.write(change, "only", false);
  change.commit();
  const Content after = reference::contentOf(readMap(file).map);
  EXPECT_FALSE(after == before);
  EXPECT_TRUE(after == reference::contentOf(drives.map()));
}

TEST_F(StoredJournal, RefusesScansOfAnotherClassTable) {
  std::mt19937 random(41);
  const std::vector<std::pair<std::function<void(SemanticClass&)>, bool>> changes = {
      {[](SemanticClass& c) { c.color = {1, 2, 3}; }, true},
      {[](SemanticClass& c) { c.ignored = true; }, true},
      {[](SemanticClass& c) { c.raw.push_back(77); }, false},
      {[](SemanticClass& c) { c.dynamic = true; }, false},
      {[](SemanticClass& c) { c.free_gain = 2.0; }, false},
  };
  for (const auto& [change, allowed] : changes) {
    Drives drives(manySettings(true));
    drives.add("only", 0, random);
    drives.table_of_settings_ = changedTable(change);
    drives.save(path_);
    MapFile file(path_, MapFile::Access::kRead);
    const std::string refusal = sentenceOf([&] { journalClasses(file); });
    EXPECT_EQ(refusal.empty(), allowed) << refusal;
    if (!allowed) {
      EXPECT_NE(refusal.find("were mapped with a class table that has other labels or flags"),
                std::string::npos);
    }
  }
}

TEST_F(StoredJournal, BoundsAreThoseOfTheBlocksInTiles) {
  std::mt19937 random(39);
  const Drives drives = twoDrives(true, random);
  const SemanticMap map = drives.map();
  Eigen::AlignedBox3d all;
  for (const auto& [index, block] : map.entries()) {
    const Eigen::Vector3d low = map.geometry().blockOrigin({index});
    all.extend(low);
    all.extend(low + Eigen::Vector3d::Constant(map.geometry().blockSize()));
  }
  const Eigen::AlignedBox3d bounds = boundsIn(map, tilesOf(map));
  EXPECT_EQ(bounds.min(), all.min());
  EXPECT_EQ(bounds.max(), all.max());
  EXPECT_TRUE(boundsIn(map, {{1000, 0, 0}}).isEmpty());
}

}  // namespace
}  // namespace bki_mapping
