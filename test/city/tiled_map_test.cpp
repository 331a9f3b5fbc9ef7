// Boxes of map files and of cities: the same bits as in the whole map, from no other file than needed.
#include "bki_mapping/city/tiled_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "bki_mapping/rules/voxel_state.h"
#include "bki_mapping/store/mapper_file.h"
#include "reference/content.h"
#include "store/map_maker.h"
#include "temporary_folder.h"

namespace bki_mapping {
namespace {

using reference::contentOf;
using Content = std::map<GridIndex, std::string>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

Eigen::AlignedBox3d everything() {
  return {Eigen::Vector3d::Constant(-kInfinity), Eigen::Vector3d::Constant(kInfinity)};
}

/// The evidence and marks of the voxels that a predicate chooses by their centres: the obvious way.
Content restricted(const SemanticMap& map, const std::function<bool(const Eigen::Vector3d&)>& chooses) {
  SemanticMap kept = infoOf().emptyMap();
  for (const auto& [index, block] : map.entries()) {
    Block::Occlusion inside;
    for (int v = 0; v < kBlockVoxels; ++v) {
      inside[static_cast<std::size_t>(v)] =
          chooses(map.geometry().voxelCentre(GridGeometry::voxelOf(index, v)));
    }
    Block& to = kept.getOrAllocate(index);
    for (std::size_t p = 0; p < block->classes().size(); ++p) {
      std::vector<EvidenceUnits> plane(block->plane(p), block->plane(p) + kBlockVoxels);
      for (std::size_t v = 0; v < plane.size(); ++v) plane[v] = inside[v] ? plane[v] : 0;
      to.add(block->classes()[p], plane.data());
    }
    to.setOcclusion(block->occlusion() & inside);
  }
  // Blocks and planes without evidence say nothing.
  Content content;
  for (const auto& [index, block] : kept.entries()) {
    SemanticMap one = infoOf().emptyMap();
    Block& to = one.getOrAllocate(index);
    for (std::size_t p = 0; p < block->classes().size(); ++p) {
      const EvidenceUnits* const plane = block->plane(p);
      if (std::any_of(plane, plane + kBlockVoxels, [](EvidenceUnits units) { return units != 0; })) {
        to.add(block->classes()[p], plane);
      }
    }
    to.setOcclusion(block->occlusion());
    if (!to.empty()) content.merge(contentOf(one));
  }
  return content;
}

struct RegionText {
  std::string file;
  int x, y;
  std::size_t tiles, blocks;
  std::string text() const {
    return "{\"file\": \"" + file +
           "\", \"bounds\": null, \"voxels\": {\"free\": 1}, \"blocks\": " + std::to_string(blocks) +
           ", \"tiles\": " + std::to_string(tiles) + ", \"bytes\": 5, \"x\": " + std::to_string(x) +
           ", \"y\": " + std::to_string(y) + ", \"inputs\": 1}";
  }
};

class City : public testing::Test {
 protected:
  void SetUp() override {
    whole_.add(randomMap(1, 400, 20));
    write(1);
  }
  /// Writes a city of the map. @param region_tiles edge of a region.
  void write(int region_tiles) {
    region_tiles_ = region_tiles;
    regions_.clear();
    std::filesystem::create_directories(folder_ / "regions");
    std::map<std::pair<int, int>, SemanticMap> maps;
    const auto regionOf = [&](int tile) { return static_cast<int>(std::floor(double(tile) / region_tiles)); };
    SemanticMap source = infoOf().emptyMap();
    source.add(whole_);
    for (const GridIndex& tile : tilesOf(source)) {
      const auto at = std::make_pair(regionOf(tile.x), regionOf(tile.y));
      maps.try_emplace(at, infoOf().emptyMap()).first->second.add(source.takeRegion(tile));
    }
    for (const auto& [at, map] : maps) {
      RegionText region{"regions/" + std::to_string(at.first) + "_" + std::to_string(at.second) + "-k.bkm",
                        at.first, at.second, tilesOf(map).size(), map.size()};
      saveMap(folder_ / region.file, infoOf(), {driveOf("a#000000+2")}, map);
      regions_.push_back(region);
    }
    writeIndex();
  }
  std::string index() const {
    std::string text =
        "{\"version\": 1, \"region_tiles\": " + std::to_string(region_tiles_) +
        ", \"resolution\": 0.3, \"drives\": [{\"name\": \"a\", \"sequence\": \"/a\", \"pieces\": "
        "[{\"file\": \"pieces/a/0.bkm\", \"id\": \"a#000000+2\", \"first\": 0, \"scans\": 2}]}], "
        "\"left_out\": {}, \"regions\": [";
    for (const RegionText& region : regions_) text += (&region == &regions_[0] ? "" : ", ") + region.text();
    return text + "]}";
  }
  void writeIndex() { writeIndex(index()); }
  void writeIndex(const std::string& text) { std::ofstream(folder_ / "index.json") << text; }
  std::string refusal(const Eigen::AlignedBox3d& box = everything(), std::size_t limit = 0) {
    return sentenceOf([&] { TiledMap(folder_.path()).readBox(box, limit); });
  }
  /// A box about a voxel's centre.
  Eigen::AlignedBox3d about(const VoxelIndex& voxel) const {
    const Eigen::Vector3d centre = whole_.geometry().voxelCentre(voxel);
    return {centre, centre};
  }

  TemporaryFolder folder_{memoryFolder()};
  SemanticMap whole_ = infoOf().emptyMap();
  int region_tiles_ = 1;
  std::vector<RegionText> regions_;
};

TEST_F(City, EachBoxEqualsTheWholeMapInIt) {
  const std::string file = folder_ / "whole.bkm";
  saveMap(file, infoOf(), {driveOf("a#000000+2")}, whole_);
  std::mt19937 random(3);
  for (const int region_tiles : {1, 3}) {
    write(region_tiles);
    TiledMap city(folder_.path()), map(file);
    ASSERT_GT(city.regions().size(), 3u);
    EXPECT_EQ(city.tileCount(), tilesOf(whole_).size());
    EXPECT_EQ(map.tileCount(), tilesOf(whole_).size());
    EXPECT_EQ(contentOf(city.readBox(everything()).map), contentOf(whole_));
    std::size_t blocks = 0;
    for (int n = 0; n < 40; ++n) {
      Eigen::AlignedBox3d box;
      for (int corner = 0; corner < 2; ++corner) {
        Eigen::Vector3d point;
        for (Eigen::Index axis = 0; axis < 3; ++axis) {
          // Half of the coordinates are those of centres; those of faces between tiles are among them.
          const int half = std::uniform_int_distribution<int>(-350, 350)(random);
          point[axis] = n % 2 == 0 ? 0.5 * half * 0.3 : 0.3 * (half / 16 * 8 + 0.5);
        }
        box.extend(point);
      }
      if (n % 5 == 0) box.max().x() = kInfinity;
      if (n % 7 == 0) box.min().z() = -kInfinity;
      const Content expected =
          restricted(whole_, [&](const Eigen::Vector3d& centre) { return box.contains(centre); });
      ASSERT_EQ(contentOf(city.readBox(box).map), expected) << n;
      ASSERT_EQ(contentOf(map.readBox(box).map), expected) << n;
      blocks += expected.size();
    }
    EXPECT_GT(blocks, 500u);
  }
}

TEST_F(City, TilesAreReadWhole) {
  TiledMap city(folder_.path());
  const GridIndex wanted = tilesOf(whole_)[5];
  SemanticMap copy = infoOf().emptyMap();
  copy.add(whole_);
  const Content expected = contentOf(copy.takeRegion(wanted));
  EXPECT_EQ(contentOf(city.readTiles({wanted, wanted, {9999, -9999, 3}}).map), expected);
  EXPECT_EQ(city.reading().tiles, 1u);
  const Eigen::Vector3d point =
      whole_.geometry().voxelCentre({{64 * wanted.x + 63, 64 * wanted.y, 64 * wanted.z}});
  EXPECT_EQ(contentOf(city.readTilesAt({point, {0.0, 0.0, 1e30}}).map), expected);
  EXPECT_THROW(city.readTilesAt({{0.0, std::nan(""), 0.0}}), std::invalid_argument);
  EXPECT_EQ(city.readTilesAt({}).map.size(), 0u);
  for (const char* spelt : {"/", "/index.json"}) {
    EXPECT_EQ(TiledMap(folder_.path() + spelt).path(), folder_.path()) << spelt;
  }
}

TEST(TilesAtPoints, ComeWithTheirNeighbourhood) {
  // What is left of a car, in the last voxel of a tile; beams crossed the car's other voxels, in the next
  // tile.
  MapInfo info = infoOf();
  std::vector<SemanticClass> classes = info.classes->classes();
  const auto car = std::find_if(classes.begin(), classes.end(), [](const auto& c) { return c.id == 40; });
  car->dynamic = true;
  car->living = false;
  info.classes = std::make_shared<ClassTable>("a table", classes);
  const Eigen::Vector3d point(63.5 * info.resolution, 0.5 * info.resolution, 0.5 * info.resolution);
  for (const bool asks : {true, false}) {
    info.parameters = asks ? "rules: {enabled: true}\n" : "rules: {enabled: true, together: 0}\n";
    SemanticMap map = info.emptyMap();
    for (int x = 63; x < 66; ++x) {
      const VoxelIndex voxel{{x, 0, 0}};
      std::vector<EvidenceUnits> hits(kBlockVoxels), misses(kBlockVoxels);
      const auto at = static_cast<std::size_t>(GridGeometry::offsetInBlock(voxel));
      hits[at] = 1000;
      misses[at] = x > 63 ? 1000 : 0;
      Block& block = map.getOrAllocate(GridGeometry::blockOf(voxel));
      block.add(40, hits.data());
      block.add(kFreeClass, misses.data());
    }
    const TemporaryFolder folder;
    const std::string path = folder / "map.bkm";
    saveMap(path, info, {driveOf("a")}, map);
    TiledMap tiles(path);
    const RuledMap read = tiles.readTilesAt({point});
    EXPECT_EQ(tiles.reading().tiles, asks ? 2u : 1u);
    EXPECT_EQ(viewPoint(read.map, read.rules, point).state, asks ? VoxelState::kFree : VoxelState::kOccupied);
  }
}

TEST_F(City, NoOtherFileIsOpened) {
  const std::string kept = regions_[4].file;
  for (std::size_t n = 0; n < regions_.size(); ++n) {
    if (regions_[n].file == kept) continue;
    std::filesystem::remove(folder_ / regions_[n].file);
    if (n % 2 == 0) std::ofstream(folder_ / regions_[n].file) << "rubbish";
  }
  TiledMap city(folder_.path());
  // The column of the region: from the centres of its first voxels to those of its last.
  const double edge = 64 * 0.3;
  const Eigen::Vector3d low(regions_[4].x * edge, regions_[4].y * edge, 0.0);
  const Eigen::AlignedBox3d column(low + Eigen::Vector3d(0.15, 0.15, -kInfinity),
                                   low + Eigen::Vector3d(edge - 0.15, edge - 0.15, kInfinity));
  Eigen::AlignedBox3d tall = column;
  const RuledMap read = city.readBox(tall);
  EXPECT_EQ(contentOf(read.map),
            restricted(whole_, [&](const Eigen::Vector3d& c) { return tall.contains(c); }));
  EXPECT_GT(read.map.size(), 0u);
  EXPECT_EQ(city.reading().files, 1u);
  EXPECT_EQ(city.reading().tiles, regions_[4].tiles);
  ASSERT_EQ(read.drives.size(), 1u);
  EXPECT_EQ(read.drives[0].id, "a#000000+2");
  EXPECT_EQ(city.driveIds(), std::set<std::string>{"a#000000+2"});
  // Up to the centres of the next voxels no other file is needed; with them, it is.
  for (Eigen::Index axis : {0, 1}) {
    tall.min()[axis] -= 0.29;
    tall.max()[axis] += 0.29;
  }
  EXPECT_EQ(contentOf(city.readBox(tall).map), contentOf(read.map));
  EXPECT_EQ(city.reading().files, 1u);
  tall.max().x() += 0.02;
  EXPECT_NE(sentenceOf([&] { city.readBox(tall); }), "");
  EXPECT_EQ(contentOf(city.readBox(column).map), contentOf(read.map)) << "a failed call changes nothing";
}

TEST_F(City, ABoxThatIsTooLargeIsRefusedBeforeItIsRead) {
  TiledMap city(folder_.path());
  const std::string sentence = sentenceOf([&] { city.readBox(everything(), 1'000'000); });
  EXPECT_NE(sentence.find("tiles of " + folder_.path() + " that are asked for take"), std::string::npos)
      << sentence;
  EXPECT_NE(sentence.find("and the limit is 1 MB; ask for a smaller box, or raise the limit"),
            std::string::npos);
  EXPECT_EQ(city.reading().tiles, 0u);
  EXPECT_EQ(contentOf(city.readBox(everything(), 1'000'000'000).map), contentOf(whole_));
  EXPECT_NO_THROW(city.readBox(about({{3, 3, 3}}), 1'000'000));
  Eigen::AlignedBox3d wrong = everything();
  wrong.min().y() = std::nan("");
  EXPECT_THROW(city.readBox(wrong), std::invalid_argument);
}

TEST_F(City, AnIndexWithoutResolutionIsRead) {
  std::string text = index();
  text.erase(text.find("\"resolution\": 0.3, "), 19);
  writeIndex(text);
  std::ofstream(folder_ / regions_[0].file) << "rubbish";
  EXPECT_EQ(TiledMap(folder_.path()).resolution(), 0.3) << "of the first region that is sound";
  for (const RegionText& region : regions_) std::ofstream(folder_ / region.file) << "rubbish";
  EXPECT_NE(sentenceOf([&] { TiledMap(folder_.path()).resolution(); }).find("is not a map"),
            std::string::npos);
}

TEST_F(City, AHostileIndexIsRefusedInOneSentence) {
  const auto with = [&](const std::string& what, const std::string& instead) {
    std::string text = index();
    const std::size_t at = text.find(what);
    EXPECT_NE(at, std::string::npos) << what;
    return text.replace(at, what.size(), instead);
  };
  const std::string first = regions_[0].file, second = regions_[1].file;
  const std::string place =
      "\"x\": " + std::to_string(regions_[1].x) + ", \"y\": " + std::to_string(regions_[1].y);
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"", "no JSON at byte"},
      {"{", "no JSON at byte"},
      {"[]", "the index is no mapping"},
      {"\xff\xfe", "no JSON at byte"},
      {std::string(1000000, '['), "nested more than 16 levels"},
      {"{\"a\": 1, \"a\": 2}", "'a' is given twice"},
      {"{\"a\": 1e999}", "a value cannot be read"},
      {with("\"version\": 1", "\"version\": 2"), "newer version"},
      {with("\"version\": 1", "\"version\": \"1\""), "'version' of the index is no whole number"},
      {with("\"region_tiles\": 1", "\"region_tiles\": 0"),
       "'region_tiles' of the index is no whole number from 1"},
      {with("\"region_tiles\": 1", "\"region_tiles\": 18446744073709551615"), "'region_tiles'"},
      {with("\"region_tiles\": 1", "\"region_tiles\": 1.5"), "'region_tiles'"},
      {with("\"resolution\": 0.3", "\"resolution\": -0.3"), "'resolution' of the index is no number above 0"},
      {with("\"resolution\": 0.3", "\"resolution\": 0.2"), "its resolution is 0.3 m, not 0.2 m"},
      {with(first, "regions/../../etc/passwd.bkm"), "is not regions/NAME.bkm"},
      {with(first, "/etc/passwd"), "is not regions/NAME.bkm"},
      {with(first, "regions/.hidden.bkm"), "is not regions/NAME.bkm"},
      {with(first, "regions/"), "is not regions/NAME.bkm"},
      {with(first, "regions/a\\u0000.bkm"), "is not regions/NAME.bkm"},
      {with(first, second), "two regions have the file"},
      {with(first, "regions/other.bkm"), "is missing, although the index"},
      {with(place, "\"x\": " + std::to_string(regions_[0].x) + ", \"y\": " + std::to_string(regions_[0].y)),
       "two regions overlap at"},
      {with(place, "\"x\": 99999999, \"y\": 0"), "'x' of region 2 is no whole number"},
      {with(place, "\"x\": 77, \"y\": 0"), "a tile lies in another region"},
      {with("\"tiles\": ", "\"tiles\": 1"), "does not fit the index of the city: it has"},
      {with("\"blocks\": ", "\"blocks\": -"), "'blocks' of region 1 is no whole number"},
      {with("\"bounds\": null", "\"bounds\": {\"min\": [0, 0], \"max\": [1, 1, 1]}"),
       "has not three numbers"},
      {with("\"id\": \"a#000000+2\"", "\"id\": 7"), "'id' of a piece of drive 1 is no text"},
      {with("\"id\": \"a#000000+2\"", "\"id\": \"b\""), "drive 'a#000000+2', which the index does not list"},
      {with("\"pieces\": [", "\"pieces\": [{\"id\": \"a#000000+2\"}, "), "is listed twice"},
      {with("\"regions\"", "\"legions\""), "the index has no 'regions'"},
      {with("\"regions\": [", "\"regions\": [], \"others\": ["), "it lists no regions"},
  };
  for (const auto& [text, words] : cases) {
    writeIndex(text);
    const std::string sentence = refusal();
    EXPECT_NE(sentence.find(words), std::string::npos) << text.substr(0, 300) << "\n" << sentence;
    EXPECT_EQ(sentence.find('\n'), std::string::npos);
    EXPECT_LT(sentence.size(), 600u);
  }
  writeIndex(std::string(64'000'001, ' '));
  EXPECT_NE(refusal().find("larger than 64 MB"), std::string::npos);
  std::string many = "[0";
  for (int n = 0; n < 2'000'000; ++n) many += ",0";
  writeIndex(many + "]");
  EXPECT_NE(refusal().find("more than 2000000 values"), std::string::npos);
  std::filesystem::remove(folder_ / "index.json");
  EXPECT_NE(refusal().find("holds no index.json, which map_city writes last"), std::string::npos);
  EXPECT_NE(sentenceOf([&] { TiledMap(folder_ / "nothing"); }).find("cannot be opened"), std::string::npos);
  EXPECT_NE(sentenceOf([&] { TiledMap(folder_ / "nothing/"); }).find("holds no index.json"),
            std::string::npos);
}

TEST_F(City, RegionsOfOtherMapsAreRefused) {
  const auto refused = [&](const std::function<void(MapInfo&)>& change) {
    write(1);
    std::filesystem::remove(folder_ / regions_[3].file);
    MapInfo info = infoOf();
    change(info);
    SemanticMap map = info.emptyMap();
    for (const auto& [index, block] : whole_.entries()) {
      const GridIndex tile = SemanticMap::regionOf(index);
      if (tile.x != regions_[3].x || tile.y != regions_[3].y) continue;
      map.getOrAllocate(index).add(0, std::vector<EvidenceUnits>(kBlockVoxels, 1).data());
    }
    saveMap(folder_ / regions_[3].file, info, {}, map);
    return refusal();
  };
  EXPECT_EQ(refused([](MapInfo&) {}), "");
  EXPECT_NE(refused([](MapInfo& info) { info.resolution = 0.2; }).find("its resolution is 0.2 m, not 0.3 m"),
            std::string::npos);
  EXPECT_NE(refused([](MapInfo& info) { info.prior = 0.5; }).find("prior"), std::string::npos);
  EXPECT_NE(refused([](MapInfo& info) { info.frame = "odom"; }).find("in frame 'odom'"), std::string::npos);
  const std::string classes = refused([](MapInfo& info) {
    std::vector<SemanticClass> named = info.classes->classes();
    named[1].name = "something else";
    info.classes = std::make_shared<ClassTable>("another", named);
  });
  EXPECT_NE(classes.find("something else"), std::string::npos) << classes;
}

TEST_F(City, IsFoundAroundItsFiles) {
  const std::string folder = std::filesystem::canonical(folder_.path()).string();
  for (const char* path :
       {"", "index.json", "regions/x.bkm", "pieces/a/b.bkm", "new.bkm", "regions/../x.ply"}) {
    EXPECT_EQ(cityAround(folder_ / path), folder) << path;
  }
  EXPECT_EQ(cityAround(folder_ / "../other.bkm"), "");
  EXPECT_EQ(cityAround("/"), "");
}

}  // namespace
}  // namespace bki_mapping
