// That a window, a file that is continued and a merge keep the latest looks, too.
#include <gtest/gtest.h>

#include "bki_mapping/settings/yaml.h"
#include "bki_mapping/store/map_keeper.h"
#include "bki_mapping/store/map_merge.h"
#include "store/kept_mapper.h"

namespace bki_mapping {
namespace {

using reference::contentOf;

/// Scans with stamps, and with pauses, so that looks have many levels.
std::vector<Scan> stampedDrive() {
  std::vector<Scan> scans = drive();
  std::uint64_t stamp = 1'700'000'000'000'000'000;
  for (std::size_t n = 0; n < scans.size(); ++n)
    scans[n].stamp = stamp += n % 50 == 0 ? 20'000'000'000 : 100'000'000;
  return scans;
}

/// The preset `robot`, with looks.
MapperConfig robotConfig() {
  MapperConfig config = configOf();
  setParameters(config, loadParameterFile(BKI_MAPPING_SOURCE_DIR "/config/presets/robot.yaml"));
  config.rules.enabled = true;
  return config;
}

TEST(KeptLooks, AreThoseOfAPlainMap) {
  const TemporaryFolder folder;
  const std::string path = folder / "map.bkm";
  const std::vector<Scan> scans = stampedDrive();
  const std::size_t half = scans.size() / 2;
  const std::vector<Scan> first(scans.begin(), scans.begin() + static_cast<std::ptrdiff_t>(half)),
      second(scans.begin() + static_cast<std::ptrdiff_t>(half), scans.end());
  const MapperConfig config = robotConfig();
  SemanticMapper plain(config, reference::smallTable());
  for (const Scan& scan : scans) plain.integrate(scan);
  std::size_t looks = 0, most = 0;
  for (const auto& [index, block] : plain.map().entries()) {
    looks += block->looks().all().size();
    most = std::max(most, block->looks().all().size());
  }
  EXPECT_GT(looks, plain.map().size());
  EXPECT_GT(most, 4u);
  const auto expected = contentOf(plain.map());

  {
    Kept kept(path, "a", config);
    std::size_t most_blocks = 0;
    for (std::size_t n = 0; n < half; ++n) {
      kept.integrate(first[n]);
      most_blocks = std::max(most_blocks, kept.mapper.map().size());
      if (n % 30 == 0) kept.keeper.save();
    }
    EXPECT_LT(most_blocks, expected.size() / 2) << "the window left most of the map in memory";
    EXPECT_EQ(kept.keeper.close(), "");
  }
  EXPECT_TRUE(same(contentIn(path), contentOfAll(first, config)));
  {
    Kept kept(path, "b", config);  // goes on with the map, and returns to where it began
    for (const Scan& scan : second) kept.integrate(scan);
    EXPECT_EQ(kept.keeper.close(), "");
  }
  EXPECT_TRUE(same(contentIn(path), expected)) << "continued";

  const auto mapOf = [&](const std::vector<Scan>& some) {
    SemanticMapper mapper(config, reference::smallTable());
    for (const Scan& scan : some) mapper.integrate(scan);
    return mapper.snapshot().map;
  };
  {
    Kept kept(folder / "added.bkm", "a", config);  // the later scans first
    for (const Scan& scan : second) kept.integrate(scan);
    kept.keeper.addMap(mapOf(first), {driveOf("b")});
    EXPECT_EQ(kept.keeper.close(), "");
    EXPECT_TRUE(same(contentIn(folder / "added.bkm"), expected)) << "added";
  }
  MergeOptions options;
  for (const auto& [name, some] : {std::pair("first", &first), std::pair("second", &second)}) {
    saveMap(folder / name, infoOfMapper(plain), {driveOf(name)}, mapOf(*some));
    options.inputs.insert(options.inputs.begin(), {folder / name, std::nullopt});
  }
  options.output = folder / "sum.bkm";
  mergeMaps(options);
  EXPECT_TRUE(same(contentIn(options.output), expected)) << "merged";
}

}  // namespace
}  // namespace bki_mapping
