// A box cleared in a map file: as in a map in memory, in all parts.
#include "bki_mapping/store/map_file.h"

#include <gtest/gtest.h>

#include <limits>

#include "bki_mapping/map/semantic_map.h"
#include "bki_mapping/store/map_merge.h"
#include "reference/content.h"
#include "store/map_maker.h"
#include "temporary_folder.h"

namespace bki_mapping {
namespace {

using reference::contentOf;

SemanticMap partOf(const std::string& path, int part) {
  MapFile file(path, MapFile::Access::kRead);
  SemanticMap map = file.info().emptyMap();
  for (const TileEntry& tile : file.tiles(part)) file.addTileTo(map, {tile.index, part});
  return map;
}

class MapClear : public testing::Test {
 protected:
  /// A file that keeps two drives apart.
  std::string makeKept() {
    MergeOptions merge;
    for (const unsigned seed : {1u, 2u}) {
      const std::string path = folder_ / std::to_string(seed);
      saveMap(path, infoOf(), {driveOf(std::to_string(seed))}, randomMap(seed));
      merge.inputs.push_back({path, std::nullopt});
    }
    merge.output = folder_ / "kept";
    merge.keep_drives = true;
    mergeMaps(merge);
    return merge.output;
  }
  static void expectCleared(const std::string& path, const Eigen::AlignedBox3d& box) {
    SemanticMap parts[] = {randomMap(1), randomMap(1), randomMap(2)};
    parts[0].add(parts[2]);
    for (int part = 0; part < 3; ++part) {
      EXPECT_FALSE(clearBox(parts[part], box).empty());
      EXPECT_TRUE(contentOf(partOf(path, part)) == contentOf(parts[part])) << part;
    }
    EXPECT_EQ(MapFile(path, MapFile::Access::kRead).drives().size(), 2u);
  }

  TemporaryFolder folder_;
};

TEST_F(MapClear, ClearsAllParts) {
  const double infinity = std::numeric_limits<double>::infinity();
  for (const Eigen::AlignedBox3d& box :
       {Eigen::AlignedBox3d(Eigen::Vector3d(-9.0, -20.0, -9.0), Eigen::Vector3d(9.1, 3.0, 5.0)),
        Eigen::AlignedBox3d(Eigen::Vector3d(-infinity, 1.0, -infinity), Eigen::Vector3d::Constant(infinity)),
        Eigen::AlignedBox3d(Eigen::Vector3d::Constant(-1e300), Eigen::Vector3d(1e300, 0.0, 1e300))}) {
    const std::string kept = makeKept(), before = folder_ / "before", output = folder_ / "output";
    std::filesystem::copy_file(kept, before, std::filesystem::copy_options::overwrite_existing);
    const ClearedFile copied = clearBoxOfFile(kept, box, output);
    EXPECT_TRUE(contentOf(partOf(kept, 0)) == contentOf(partOf(before, 0)));
    expectCleared(output, box);
    const ClearedFile changed = clearBoxOfFile(kept, box);
    expectCleared(kept, box);
    SemanticMap sum = loadMap(before).map;
    EXPECT_EQ(changed.blocks, clearBox(sum, box).size());
    EXPECT_EQ(copied.blocks, changed.blocks);
    EXPECT_EQ(copied.tiles, changed.tiles);
    EXPECT_EQ(clearBoxOfFile(kept, box, kept).blocks, 0u);
  }
}

TEST_F(MapClear, RefusesBoxesThatAreNoNumbers) {
  const std::string kept = makeKept();
  EXPECT_THROW(clearBoxOfFile(kept, {Eigen::Vector3d(0.0, std::nan(""), 0.0), Eigen::Vector3d::Ones()}),
               std::invalid_argument);
  const MapFile reader(kept, MapFile::Access::kRead);
  EXPECT_THROW(clearBoxOfFile(kept, {Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones()}), MapFileInUse);
}

}  // namespace
}  // namespace bki_mapping
