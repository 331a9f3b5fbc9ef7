// A map that is loaded from a city near the sensor: each tile counts once, next to all scans, and the city
// stays as it is.
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <set>
#include <thread>

#include "bki_mapping/map/semantic_map.h"
#include "bki_mapping/store/mapper_file.h"
#include "refusal_of.h"
#include "ros/kept_map.h"
#include "ros/map_file_settings.h"
#include "store/file_content.h"
#include "store/kept_mapper.h"

namespace bki_mapping::ros_interface {
namespace {

using reference::contentOf;
using Content = std::map<GridIndex, std::string>;

constexpr int kRegionTiles = 2;
constexpr double kEdge = 64 * 0.5;  ///< of a tile [m]

class KeptCity : public testing::Test {
 protected:
  void SetUp() override {
    SemanticMapper maker(configOf(), reference::smallTable());
    std::uint64_t stamp = 1000;
    for (double x = -150.0; x <= 350.0; x += 12.0) maker.integrate(scanAt(x, 8.0, ++stamp));
    whole_.emplace(maker.snapshot().map);
    info_ = infoOfMapper(maker);
    info_.frame = "map";
    info_.parameters = "";
    write(info_);
    config_.map_file = folder_.path() + "/city/";
    config_.map_load_radius = 40.0;
  }
  /// Writes the city. @param info of its regions.
  void write(const MapInfo& info) {
    std::filesystem::remove_all(city());
    std::filesystem::create_directories(city() + "/regions");
    const auto regionOf = [](int tile) { return static_cast<int>(std::floor(double(tile) / kRegionTiles)); };
    SemanticMap source = info_.emptyMap();
    source.add(*whole_);
    std::map<std::pair<int, int>, SemanticMap> maps;
    for (const GridIndex& tile : tilesOf(*whole_)) {
      const auto at = std::make_pair(regionOf(tile.x), regionOf(tile.y));
      maps.try_emplace(at, info_.emptyMap()).first->second.add(source.takeRegion(tile));
    }
    std::string regions;
    const bool same_grid =
        info.resolution == info_.resolution && info.classes->size() == info_.classes->size();
    for (const auto& [at, map] : maps) {
      const std::string file =
          "regions/" + std::to_string(at.first) + "_" + std::to_string(at.second) + ".bkm";
      MapInfo own = info;
      NewMapFile made(city() + "/" + file, own);
      made.content().putDrive(newDrive("monday#0"));
      if (same_grid) {
        for (const GridIndex& tile : tilesOf(map)) made.content().writeTile(map, {tile});
      }
      made.commit();
      regions += (regions.empty() ? "" : ", ") + ("{\"file\": \"" + file) +
                 "\", \"bounds\": null, \"x\": " + std::to_string(at.first) +
                 ", \"y\": " + std::to_string(at.second) +
                 ", \"bytes\": 1, \"tiles\": " + std::to_string(same_grid ? tilesOf(map).size() : 0) +
                 ", \"blocks\": " + std::to_string(same_grid ? map.size() : 0) + "}";
    }
    std::ofstream(city() + "/index.json")
        << "{\"version\": 1, \"region_tiles\": " << kRegionTiles
        << ", \"drives\": [{\"name\": \"monday\", \"pieces\": [{\"id\": \"monday#0\"}]}], \"regions\": ["
        << regions << "]}";
  }
  std::string city() const { return folder_.path() + "/city"; }
  /// The bytes of all files of the city.
  std::map<std::string, std::string> cityBytes() const {
    std::map<std::string, std::string> bytes;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(city())) {
      if (entry.is_regular_file()) bytes[entry.path().string()] = readFile(entry.path().string());
    }
    return bytes;
  }

  /// A mapper that is started with the city.
  struct Robot {
    explicit Robot(const ServerConfig& given) : config(given), kept(mapper, config, "robot") {}
    void map(const Scan& scan) {
      mapper.integrate(scan);
      kept.addScan(scan.stamp, scan.origin, config);
    }
    /// Lets everything arrive that is wanted.
    void settle() {
      const auto end = PeriodicSave::Clock::now() + std::chrono::seconds(60);
      do {
        kept.update(config, PeriodicSave::Clock::now());
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        ASSERT_LT(PeriodicSave::Clock::now(), end);
      } while (kept.isLoading());
    }
    ServerConfig config;
    SemanticMapper mapper{configOf(), reference::smallTable()};
    KeptMap kept;
  };
  /// The tiles of the city within the radius of any of some places: the obvious way.
  std::set<GridIndex> tilesNear(const std::vector<Scan>& scans) const {
    std::set<GridIndex> near;
    for (const GridIndex& tile : tilesOf(*whole_)) {
      const Eigen::Array3d low = kEdge * Eigen::Array3d(tile.x, tile.y, tile.z);
      for (const Scan& scan : scans) {
        const Eigen::Array3d from = scan.origin.array();
        const double distance = (low - from).max(from - (low + kEdge)).maxCoeff();
        if (distance < config_.map_load_radius - 0.25) near.insert(tile);
      }
    }
    return near;
  }
  /// The sum of the scans, and of some tiles of the city, each once.
  SemanticMap sumOf(const std::vector<Scan>& scans, const std::set<GridIndex>& tiles,
                    const Eigen::AlignedBox3d& cleared = {}) const {
    SemanticMapper mapper(configOf(), reference::smallTable());
    SemanticMap city = info_.emptyMap();
    city.add(*whole_);
    for (const GridIndex& tile : tiles) mapper.addMap(city.takeRegion(tile));
    if (!cleared.isEmpty()) mapper.clearBox(cleared);
    for (const Scan& scan : scans) mapper.integrate(scan);
    return mapper.snapshot().map;
  }

  TemporaryFolder folder_{memoryFolder()};
  MapInfo info_;
  std::optional<SemanticMap> whole_;
  ServerConfig config_;
};

TEST_F(KeptCity, LoadsWhatIsNearTheSensorOnce) {
  const auto before = cityBytes();
  Robot robot(config_);
  robot.settle();
  EXPECT_EQ(robot.mapper.map().size(), 0u) << "no pose is known yet";
  std::vector<Scan> scans;
  for (const double x : {0.0, 3.0, 90.0, 180.0, 90.0, 0.0}) {
    scans.push_back(scanAt(x, 0.0, scans.size() + 1));
    robot.map(scans.back());
    robot.settle();
    ASSERT_EQ(contentOf(robot.mapper.map()), contentOf(sumOf(scans, tilesNear(scans)))) << x;
  }
  EXPECT_LT(tilesNear(scans).size(), tilesOf(*whole_).size()) << "the test shows nothing";
  EXPECT_EQ(robot.kept.fault(), "");
  EXPECT_EQ(cityBytes(), before);
  // A saved map holds what is in memory, and names the drives.
  const KeptMap::Saving saving = robot.kept.saveTo(folder_ / "saved.bkm");
  EXPECT_FALSE(saving.done.valid());
  ASSERT_EQ(saving.drives.size(), 2u);
  EXPECT_EQ(saving.drives[0].id, "monday#0");
}

TEST_F(KeptCity, AWindowMovesTilesToTheMappersOwnFile) {
  const auto before = cityBytes();
  config_.window = kWindow;
  config_.own_map_file = folder_ / "own.bkm";
  config_.map_load_radius = 1000.0;  // of which the window allows 30 m
  std::vector<Scan> scans;
  {
    Robot robot(config_);
    for (const double x : {0.0, 90.0, 180.0, 180.5, 90.0, 0.0}) {
      scans.push_back(scanAt(x, 0.0, scans.size() + 1));
      robot.map(scans.back());
      robot.settle();
    }
    EXPECT_LT(tilesOf(robot.mapper.map()).size(), 20u) << "far tiles have left memory";
    EXPECT_EQ(robot.kept.fault(), "");
    EXPECT_EQ(robot.kept.close(), "");
  }
  config_.map_load_radius = 0.5 * kWindow;
  StoredMap own = loadMap(config_.own_map_file);
  EXPECT_EQ(contentOf(own.map), contentOf(sumOf(scans, tilesNear(scans))));
  EXPECT_EQ(own.drives.size(), 2u);
  EXPECT_EQ(cityBytes(), before);
  // A second start would count tiles twice.
  EXPECT_NE(
      bki_mapping::sentenceOf([&] { Robot{config_}; }).find("exists already, and may hold tiles of the city"),
      std::string::npos);
}

TEST_F(KeptCity, ClearingAndResettingReachTilesThatComeLater) {
  Robot robot(config_);
  std::vector<Scan> scans = {scanAt(0.0, 0.0, 1)};
  const Eigen::AlignedBox3d box(Eigen::Vector3d(-1000.0, -3.0, -1000.0),
                                Eigen::Vector3d(1000.0, 12.0, 1000.0));
  robot.kept.clearBox(box);
  for (const Scan& scan : scans) robot.map(scan);
  robot.settle();
  ASSERT_EQ(contentOf(robot.mapper.map()), contentOf(sumOf(scans, tilesNear(scans), box)));
  robot.kept.reset();
  EXPECT_EQ(robot.mapper.map().size(), 0u);
  robot.map(scans[0]);
  robot.settle();
  EXPECT_EQ(contentOf(robot.mapper.map()), contentOf(sumOf(scans, tilesNear(scans))));
  robot.map(scanAt(90.0, 0.0, 2));
  robot.kept.reset();  // while tiles are being read
  robot.map(scans[0]);
  robot.settle();
  EXPECT_EQ(contentOf(robot.mapper.map()), contentOf(sumOf(scans, tilesNear(scans))));
}

TEST_F(KeptCity, AMapThatIsAddedMustNotHoldItsDrives) {
  Robot robot(config_);
  robot.map(scanAt(0.0, 0.0, 1));
  robot.settle();
  StoredMap same = loadMap(city() + "/regions/0_0.bkm");
  EXPECT_THROW(robot.kept.addMap(std::move(same), false), std::invalid_argument);
  // Instead of the map, it may come: the city is then out of the game.
  same = loadMap(city() + "/regions/0_0.bkm");
  const Content expected = contentOf(same.map);
  robot.kept.addMap(std::move(same), true);
  robot.settle();
  EXPECT_EQ(contentOf(robot.mapper.map()), expected);
}

TEST_F(KeptCity, WithABrokenCityMappingGoesOn) {
  const std::vector<Scan> scans = {scanAt(0.0, 0.0, 1)};
  const auto faultOf = [&](std::size_t* blocks = nullptr) {
    Robot robot(config_);
    robot.map(scans[0]);
    robot.settle();
    EXPECT_GE(robot.mapper.map().size(), sumOf(scans, {}).size());
    if (blocks) *blocks = robot.mapper.map().size();
    return robot.kept.fault();
  };
  const auto has = [](const std::string& sentence, const std::string& words) {
    return sentence.find(words) != std::string::npos && sentence.find('\n') == std::string::npos;
  };
  EXPECT_EQ(faultOf(), "");
  std::size_t whole = 0, part = 0;
  faultOf(&whole);
  writeFile(city() + "/regions/0_0.bkm", "rubbish");
  const std::string fault = faultOf(&part);
  EXPECT_TRUE(has(fault, "regions/0_0.bkm is not a map")) << fault;
  EXPECT_LT(part, whole);
  EXPECT_GT(part, sumOf(scans, {}).size()) << "the other regions are loaded";
  {
    ServerConfig config = config_;
    config.own_map_file = folder_ / "own.bkm";
    Robot robot(config);
    robot.map(scans[0]);
    robot.settle();
    EXPECT_NE(robot.kept.fault(), "");
    EXPECT_EQ(robot.kept.fileFault(), "") << "nothing keeps the map from being saved";
  }
  std::filesystem::remove(city() + "/regions/0_0.bkm");
  EXPECT_TRUE(has(faultOf(), "regions/0_0.bkm is missing"));
  MapInfo other = info_;
  other.frame = "odom";
  write(other);
  EXPECT_TRUE(has(faultOf(), "is in frame 'odom', and the mapper maps in 'map'"));
  other = info_;
  other.resolution = 0.25;
  write(other);
  EXPECT_TRUE(has(faultOf(), "the resolution of")) << faultOf();
  other = info_;
  other.classes = infoOf().classes;
  write(other);
  EXPECT_NE(faultOf(), "");
  std::filesystem::remove(city() + "/index.json");
  EXPECT_TRUE(has(faultOf(), "holds no index.json"));
  std::filesystem::remove_all(city());
  EXPECT_TRUE(has(faultOf(), "holds no index.json"));
}

TEST_F(KeptCity, MemoryLimitEndsLoadingWithASentence) {
  config_.map_load_radius = 300.0;
  MapperConfig small = configOf("line", 10.0);
  SemanticMapper mapper(small, reference::smallTable());
  KeptMap kept(mapper, config_, "robot");
  const Scan scan = scanAt(0.0, 0.0, 1);
  mapper.integrate(scan);
  kept.addScan(scan.stamp, scan.origin, config_);
  const auto end = PeriodicSave::Clock::now() + std::chrono::seconds(60);
  do {
    kept.update(config_, PeriodicSave::Clock::now());
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  } while (kept.isLoading() && PeriodicSave::Clock::now() < end);
  EXPECT_LT(static_cast<double>(mapper.mapBytes()), 10e6);
  EXPECT_GT(tilesOf(mapper.map()).size(), 2u);
  EXPECT_NE(kept.fault().find("because memory_limit is reached; set own_map_file and window"),
            std::string::npos)
      << kept.fault() << mapper.mapBytes();
}

TEST_F(KeptCity, SettingsThatContradictEachOtherAreRefused) {
  const auto refusal = [](const ServerConfig& config) {
    return refusalOf([&] { checkMapFileSettings(config); });
  };
  ServerConfig config = config_;
  EXPECT_EQ(refusal(config), "");
  config.window = 50.0;
  EXPECT_NE(refusal(config).find("set own_map_file"), std::string::npos);
  config.own_map_file = folder_ / "own.bkm";
  EXPECT_EQ(refusal(config), "");
  config.own_map_file = folder_ / "own.ply";
  EXPECT_NE(refusal(config).find("own_map_file"), std::string::npos);
  config.own_map_file = city() + "/own.bkm";
  EXPECT_NE(refusal(config).find("which only map_city may change"), std::string::npos);
  config = config_;
  config.read_only = true;
  EXPECT_NE(refusal(config).find("read_only publishes a whole map"), std::string::npos);
  config = config_;
  config.map_file = "city/";
  EXPECT_NE(refusal(config).find("absolute"), std::string::npos);
  config.map_file = city() + "/regions/0_0.bkm";
  EXPECT_NE(refusal(config).find("which only map_city may change"), std::string::npos);
  config.read_only = true;
  EXPECT_EQ(refusal(config), "");
  config = ServerConfig();
  config.own_map_file = folder_ / "own.bkm";
  EXPECT_NE(refusal(config).find("whose map_file is a city"), std::string::npos);
}

}  // namespace
}  // namespace bki_mapping::ros_interface
