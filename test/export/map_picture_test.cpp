// What inspect_map says and draws, against a look at each voxel.
#include "export/map_picture.h"

#include <gtest/gtest.h>
#include <png.h>

#include <map>

#include "bki_mapping/settings/yaml.h"
#include "bki_mapping/store/mapper_file.h"
#include "export/display_colors.h"
#include "export/map_statistics.h"
#include "store/map_maker.h"
#include "temporary_folder.h"

namespace bki_mapping {
namespace {

MapInfo infoWithGains() {
  MapInfo info = infoOf();
  std::vector<SemanticClass> classes = info.classes->classes();
  classes[1].living = false;  // so that its voxels ask their neighbourhood
  info.classes = std::make_shared<ClassTable>("a table", classes);
  info.parameters =
      "resolution: 7\nunknown: 1\nrules:\n  enabled: true\n  stands_after: 3\n  together: 0.9\n";
  return info;
}

struct Inspected {
  MapStatistics statistics;
  Picture top, profile;
};

Inspected inspect(const std::string& path) {
  MapFile file(path, MapFile::Access::kRead);
  const StateRules rules = storedRules(path, file.info());
  Inspected result;
  result.statistics = readStatistics(file, rules);
  MapPicture top(MapPicture::View::kTop, result.statistics.low, result.statistics.high),
      profile(MapPicture::View::kProfile, result.statistics.low, result.statistics.high);
  readStatistics(file, rules, [&](const BlockIndex& index, const BlockView& view) {
    top.add(index, view);
    profile.add(index, view);
  });
  result.top = top.draw(*file.info().classes);
  result.profile = profile.draw(*file.info().classes);
  return result;
}

/// A random map with a voxel of which only occlusion is known.
SemanticMap markedMap(unsigned seed, int blocks, int extent) {
  SemanticMap map = randomMap(seed, blocks, extent);
  Block::Occlusion marks;
  marks[5] = true;
  map.getOrAllocate({extent + 1, 0, 0}).setOcclusion(marks);
  return map;
}

/// The rules of infoWithGains().
StateRules rulesWithGains() {
  RulesConfig rules;
  rules.enabled = true;
  rules.stands_after = 3.0;
  rules.together = 0.9;
  const MapInfo info = infoWithGains();
  return {rules, *info.classes, info.resolution};
}

/// Compares the counts with a look at each voxel.
void expectCounts(const MapStatistics& found, const SemanticMap& map,
                  const StateRules& rules = rulesWithGains()) {
  MapStatistics expected;
  GridIndex low{1 << 30, 1 << 30, 1 << 30}, high{-(1 << 30), -(1 << 30), -(1 << 30)};
  std::size_t bytes = 0;
  for (const auto& [index, block] : map.entries()) {
    bytes += block->bytes();
    for (int v = 0; v < kBlockVoxels; ++v) {
      const VoxelView view = viewVoxel(map, rules, index, *block, v);
      expected.free += view.state == VoxelState::kFree;
      expected.occluded += view.state == VoxelState::kOccluded;
      expected.occupied += view.state == VoxelState::kOccupied;
      if (view.state == VoxelState::kOccupied) ++expected.occupied_by_class[view.label];
      if (view.state == VoxelState::kUnknown) continue;
      const VoxelIndex voxel = GridGeometry::voxelOf(index, v);
      low = {std::min(low.x, voxel.x), std::min(low.y, voxel.y), std::min(low.z, voxel.z)};
      high = {std::max(high.x, voxel.x), std::max(high.y, voxel.y), std::max(high.z, voxel.z)};
    }
  }
  EXPECT_EQ(found.free, expected.free);
  EXPECT_EQ(found.occupied, expected.occupied);
  EXPECT_EQ(found.occluded, expected.occluded);
  EXPECT_EQ(found.occupied_by_class, expected.occupied_by_class);
  EXPECT_EQ(found.blocks, map.size());
  EXPECT_EQ(found.tiles, tilesOf(map).size());
  EXPECT_EQ(found.low, low);
  EXPECT_EQ(found.high, high);
  EXPECT_NEAR(static_cast<double>(found.memory_bytes), static_cast<double>(bytes),
              0.1 * static_cast<double>(bytes));
  const Eigen::AlignedBox3d box = found.bounds(0.3);
  EXPECT_TRUE(box.min().isApprox(0.3 * Eigen::Vector3d(low.x, low.y, low.z)));
  EXPECT_TRUE(box.max().isApprox(0.3 * Eigen::Vector3d(high.x + 1, high.y + 1, high.z + 1)));
}

TEST(MapStatistics, CountsVoxelsAsTheMapperSeesThem) {
  const TemporaryFolder folder;
  const std::string path = folder / "map.bkm";
  saveMap(path, infoWithGains(), {driveOf("a")}, markedMap(3, 60, 12));
  const MapStatistics found = inspect(path).statistics;
  EXPECT_GT(found.occluded, 0u);
  expectCounts(found, markedMap(3, 60, 12));
}

TEST(MapStatistics, SeesTheTilesBesideEachTile) {
  SemanticMap map = infoOf().emptyMap();
  const SemanticMap blocks = randomMap(7, 400);
  auto block = blocks.entries().begin();
  // On both sides of the faces of many tiles, so that voxels ask those of other tiles.
  for (int x = -72; x <= 72; x += 8) {
    for (const int face : {x - 1, x}) {
      for (const GridIndex& at :
           {GridIndex{face, -1, -1}, {face, 0, -1}, {face, 0, 0}, {face, 8, 0}, {face, 24, 0}}) {
        const Block& content = *(*block).block;
        ++block;
        for (const ClassId id : content.classes())
          map.getOrAllocate(BlockIndex{at}).add(id, content.evidence(id));
      }
    }
  }
  const TemporaryFolder folder;
  const std::string path = folder / "map.bkm";
  saveMap(path, infoWithGains(), {driveOf("a")}, map);
  expectCounts(inspect(path).statistics, map);
}

/// Which coordinates a viewer sees to the right, up and towards himself: x 0, y 1, z 2; -1 - axis: reversed.
struct Axes {
  int right, up, towards;
};

int coordinate(const GridIndex& i, int axis) {
  const int values[] = {i.x, i.y, i.z};
  return axis < 0 ? -values[-1 - axis] : values[axis];
}

/// The place of the nearest voxel in each cell of a picture, by right and up.
using Nearest = std::map<std::pair<int, int>, std::pair<int, ClassId>>;

/// How bright a cell is: 0.7 if all 24 cells around it are 8 voxels nearer.
double brightnessOf(const Nearest& nearest, const std::pair<int, int>& cell) {
  double shade = 0.0;
  int around = 0;
  for (const auto& [other, seen] : nearest) {
    if (seen.second == kFreeClass || other == cell) continue;
    if (std::abs(other.first - cell.first) > 2 || std::abs(other.second - cell.second) > 2) continue;
    ++around;
    shade += std::min(8, std::max(0, seen.first - nearest.at(cell).first)) / 8.0;
  }
  return around == 0 ? 1.0 : 1.0 - 0.3 * shade / around;
}

/// The colours of what is nearest.
Picture drawn(const SemanticMap& map, const MapStatistics& found, const Axes& axes, int pixels) {
  const int right = axes.right, up = axes.up, towards = axes.towards;
  const int left = coordinate(found.low, right), below = coordinate(found.low, up);
  const int far = std::min(coordinate(found.low, towards), coordinate(found.high, towards));
  Picture picture;
  picture.width = (coordinate(found.high, right) - left + 1) * pixels;
  picture.height = (coordinate(found.high, up) - below + 1) * pixels;
  picture.pixels.assign(static_cast<std::size_t>(picture.width * picture.height), Color{255, 255, 255});
  const ClassTable shown = displayTable(*infoOf().classes);
  Nearest nearest;
  forEachKnownVoxel(map, rulesWithGains(), [&](const VoxelIndex& voxel, const VoxelView& view) {
    if (view.state == VoxelState::kOccluded) return;
    const int nearness = view.state == VoxelState::kFree ? far - 1 : coordinate(voxel, towards);
    const ClassId label = view.state == VoxelState::kFree ? kFreeClass : view.label;
    const std::pair<int, int> cell(coordinate(voxel, right) - left, coordinate(voxel, up) - below);
    const auto known = nearest.find(cell);
    if (known == nearest.end() || known->second.first < nearness) nearest[cell] = {nearness, label};
  });
  for (const auto& [cell, seen] : nearest) {
    Color color = kFreeColor;
    if (seen.second != kFreeClass) {
      color = shown.find(seen.second)->color;
      for (std::uint8_t& part : color) {
        part = static_cast<std::uint8_t>(brightnessOf(nearest, cell) * part);
      }
    }
    for (int y = 0; y < pixels; ++y) {
      const int row = picture.height - 1 - (cell.second * pixels + y);
      const auto first = picture.pixels.begin() + row * picture.width + cell.first * pixels;
      std::fill(first, first + pixels, color);
    }
  }
  return picture;
}

void expectSame(const Picture& found, const Picture& expected) {
  ASSERT_EQ(found.width, expected.width);
  ASSERT_EQ(found.height, expected.height);
  int different = 0;
  for (std::size_t i = 0; i < found.pixels.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) {  // brightness may be rounded to another number
      different += std::abs(int{found.pixels[i][c]} - int{expected.pixels[i][c]}) > 1;
    }
  }
  EXPECT_EQ(different, 0);
}

TEST(MapPicture, ShowsWhatIsNearest) {
  const TemporaryFolder folder;
  const std::string path = folder / "map.bkm";
  saveMap(path, infoWithGains(), {}, markedMap(3, 60, 3));
  const Inspected inspected = inspect(path);
  const SemanticMap map = markedMap(3, 60, 3);
  const GridIndex &low = inspected.statistics.low, &high = inspected.statistics.high;
  const bool along_y = high.y - low.y > high.x - low.x;
  const int top_edge = std::max(high.x - low.x, high.y - low.y) + 1;
  expectSame(inspected.top, drawn(map, inspected.statistics, {0, 1, 2}, 2048 / top_edge));
  const int profile_edge = std::max(top_edge, high.z - low.z + 1);
  expectSame(inspected.profile,
             drawn(map, inspected.statistics, along_y ? Axes{1, 2, 0} : Axes{0, 2, -2}, 2048 / profile_edge));
}

TEST(MapPicture, TurnsProfilesToTheLongerSide) {
  for (const bool along_y : {false, true}) {
    const TemporaryFolder folder;
    const std::string path = folder / "map.bkm";
    SemanticMap map = infoOf().emptyMap();
    // A wall of class 40 in front, as the viewer sees it, of one of class 80, which is longer to the right.
    std::vector<EvidenceUnits> plane(kBlockVoxels, 100);
    const auto block = [&](int right, int back) -> Block& {
      return map.getOrAllocate(along_y ? BlockIndex{{-back, right, 0}} : BlockIndex{{right, back, 0}});
    };
    for (int right = 0; right < 3; ++right) block(right, 0).add(40, plane.data());
    for (int right = 0; right < 5; ++right) block(right, 2).add(80, plane.data());
    saveMap(path, infoOf(), {}, map);
    const Picture profile = inspect(path).profile;
    EXPECT_EQ(profile.width, 2048 / 40 * 40);
    EXPECT_EQ(profile.height, 2048 / 40 * 8);
    const auto width = static_cast<std::size_t>(profile.width);
    EXPECT_EQ(profile.pixels[width / 4], (Color{1, 128, 255})) << along_y;
    const Color behind = displayTable(*infoOf().classes).find(80)->color;
    EXPECT_EQ(profile.pixels[width - 1], behind) << along_y;
    const Color beside = profile.pixels[width / 40 * 24 + 5];  // the first column behind
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_LE(beside[c], behind[c]) << along_y;
      EXPECT_GE(beside[c], behind[c] / 2) << along_y;
    }
    EXPECT_NE(beside, behind) << along_y;
  }
}

TEST(MapPicture, FloorsKeepTheirColourBelowCeilings) {
  SemanticMap map = infoOf().emptyMap();
  std::vector<EvidenceUnits> floor(kBlockVoxels, 0), ceiling(kBlockVoxels, 0);
  for (std::size_t v = 0; v < 64; ++v) floor[v] = 100;
  for (std::size_t v = 0; v < 64; v += 4) ceiling[v] = 100;  // a fourth of it, as few beams meet it
  for (int x = 0; x < 6; ++x) {
    for (int y = 0; y < 6; ++y) {
      map.getOrAllocate({{x, y, 0}}).add(40, floor.data());
      if (x < 4) map.getOrAllocate({{x, y, 3}}).add(80, ceiling.data());
    }
  }
  const TemporaryFolder folder;
  saveMap(folder / "map.bkm", infoOf(), {}, map);
  const Picture top = inspect(folder / "map.bkm").top;
  const Color floor_color = infoOf().classes->find(40)->color;  // (1, 128, 255)
  const int pixels = top.width / 48;
  std::size_t plain = 0, darkened = 0;
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 48; ++x) {
      const Color color = top.pixels[static_cast<std::size_t>((y * top.width + x) * pixels)];
      if (x < 32 && x % 4 == 0) continue;  // the ceiling
      EXPECT_GE(color[1], floor_color[1] * 3 / 4) << x << " " << y;
      EXPECT_GE(color[2], floor_color[2] * 3 / 4) << x << " " << y;
      (color == floor_color ? plain : darkened) += 1;
    }
  }
  EXPECT_GT(darkened, 500u) << "below the ceiling";
  EXPECT_GT(plain, 500u) << "beside it";
}

TEST(MapPicture, LeavesOutWhatIsAboveTheHighestVoxel) {
  MapPicture picture(MapPicture::View::kTop, {0, 0, 0}, {7, 7, 3});
  BlockView view;
  view.state.fill(VoxelState::kUnknown);
  view.label.fill(40);
  view.state[0] = view.state[64 * 3 + 1] = view.state[64 * 4 + 2] = VoxelState::kOccupied;
  view.state[64 * 7 + 3] = VoxelState::kFree;
  picture.add({{0, 0, 0}}, view);
  const Picture drawn = picture.draw(*infoOf().classes);
  const auto at = [&](std::size_t x) {
    return drawn.pixels[drawn.pixels.size() - static_cast<std::size_t>(drawn.width) +
                        x * static_cast<std::size_t>(drawn.width) / 8];
  };
  EXPECT_NE(at(0), (Color{255, 255, 255}));
  EXPECT_NE(at(1), (Color{255, 255, 255}));
  EXPECT_EQ(at(2), (Color{255, 255, 255})) << "above";
  EXPECT_EQ(at(3), (Color{255, 255, 255})) << "above";
}

TEST(MapPicture, ReducesLargeMaps) {
  MapPicture picture(MapPicture::View::kTop, {-50000, -10, 0}, {49999, 9, 7});
  EXPECT_EQ(picture.voxelsPerPixel(), 49.0);
  BlockView view;
  view.state.fill(VoxelState::kOccupied);
  view.label.fill(40);
  picture.add({{-6250, 0, 0}}, view);
  picture.add({{6249, 0, 0}}, view);
  const Picture drawn = picture.draw(*infoOf().classes);
  EXPECT_EQ(drawn.width, 2041);
  EXPECT_EQ(drawn.height, 1);
  EXPECT_NE(drawn.pixels.front(), (Color{255, 255, 255}));
  EXPECT_EQ(drawn.pixels[1000], (Color{255, 255, 255}));
  EXPECT_NE(drawn.pixels.back(), (Color{255, 255, 255}));
  const MapStatistics nothing;
  EXPECT_EQ(MapPicture(MapPicture::View::kTop, nothing.low, nothing.high).draw(*infoOf().classes).width, 1);
}

TEST(MapPicture, WritesPng) {
  const TemporaryFolder folder;
  const Picture picture{3, 2, {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}, {10, 20, 30}, {40, 50, 60}, {255, 0, 128}}};
  writePng(folder / "a.png", picture);
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  ASSERT_TRUE(png_image_begin_read_from_file(&image, (folder / "a.png").c_str()));
  image.format = PNG_FORMAT_RGB;
  EXPECT_EQ(image.width, 3u);
  EXPECT_EQ(image.height, 2u);
  std::vector<Color> pixels(6);
  ASSERT_TRUE(png_image_finish_read(&image, nullptr, pixels.data(), 0, nullptr));
  EXPECT_EQ(pixels, picture.pixels);
  EXPECT_THROW(writePng(folder / "no/a.png", picture), std::runtime_error);
}

TEST(MapFileGains, OfAPresetBeforeRulesWereCountedInScansAreThoseOfRulesNow) {
  MapInfo info = infoWithGains();
  RulesConfig rules;
  info.parameters = "scan_limit: {hits: 0.2}\nfree_gain: {dynamic: 3}\n";
  EXPECT_TRUE(storedRules("FILE", info).decidesAs(StateRules(rules, *info.classes, info.resolution)));
  info.parameters = "scan_limit: {hits: 0.02}\nfree_gain: {dynamic: 3000}\n";
  rules.enabled = true;
  EXPECT_TRUE(storedRules("FILE", info).decidesAs(StateRules(rules, *info.classes, info.resolution)));
}

TEST(MapFileGains, RefusesParametersThatAreNone) {
  MapInfo info = infoOf();
  std::vector<SemanticClass> classes = info.classes->classes();
  classes[1].living = false;  // so that its voxels ask their neighbourhood
  info.classes = std::make_shared<ClassTable>("a table", classes);
  info.parameters = "rules: {stands_after: -1}";
  EXPECT_NE(sentenceOf([&] { storedRules("FILE", info); }).find("the parameters in FILE cannot be used"),
            std::string::npos);
  info.parameters = "[";
  EXPECT_NE(sentenceOf([&] { storedRules("FILE", info); }), "");
  info.parameters = parameterYaml(MapperConfig());
  EXPECT_EQ(sentenceOf([&] { storedRules("FILE", info); }), "");
}

}  // namespace
}  // namespace bki_mapping
