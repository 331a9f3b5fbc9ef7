// Pages for browsers: what is in them, read back, is what the map says of each voxel.
#include "export/html_export.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "bki_mapping/store/mapper_file.h"
#include "refusal_of.h"
#include "sequence/trajectory_file.h"
#include "store/map_maker.h"
#include "store/summand.h"
#include "store/tile_codec.h"
#include "temporary_folder.h"

namespace bki_mapping {
namespace {

using nlohmann::json;

const StateRules kRules = StateRules().withFreeGain(80, 0.1);

SemanticMap someMap(unsigned seed = 4) {
  SemanticMap map = randomMap(seed, 60, 12);
  Block::Occlusion marks;  // in a block of their own, whatever the random ones have
  marks.set(5).set(300);
  map.getOrAllocate({{20, -20, 3}}).setOcclusion(marks);
  return map;
}

std::string bytesOf(const std::string& base64) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  unsigned held = 0, bits = 0;
  for (const char c : base64) {
    if (c == '=') break;
    held = held << 6 | static_cast<unsigned>(digits.find(c));
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    bytes += static_cast<char>(held >> bits & 0xffu);
  }
  return bytes;
}

std::string inflated(const std::string& packed, std::size_t size) {
  std::string bytes(size + 1, '\0');
  uLongf found = bytes.size();
  EXPECT_EQ(uncompress(reinterpret_cast<Bytef*>(bytes.data()), &found,
                       reinterpret_cast<const Bytef*>(packed.data()), packed.size()),
            Z_OK);
  EXPECT_EQ(found, size);
  bytes.resize(size);
  return bytes;
}

/// The contents of all elements that begin with a tag.
std::vector<std::string> elements(const std::string& html, const std::string& tag) {
  std::vector<std::string> found;
  for (std::size_t at = 0; (at = html.find(tag, at)) != std::string::npos;) {
    at += tag.size();
    found.push_back(html.substr(at, html.find("</script>", at) - at));
  }
  return found;
}

/// A page, taken apart.
struct Page {
  std::string html;
  json header;
  std::vector<std::string> voxels, evidence;  ///< of each tile, unpacked from base64
};

class HtmlExport : public testing::Test {
 protected:
  HtmlExport() {
    std::ofstream(folder_ / "three.js") << "var THREE = {text: '</script><script>'};\n";
    options_.three_js = folder_ / "three.js";
  }
  std::string exported(const SemanticMap& map, const ClassTable& classes) {
    const std::string path = folder_ / "map.html";
    exportHtml(path, map, kRules, classes, options_);
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  Page read(const SemanticMap& map, const ClassTable& classes = *infoOf().classes) {
    Page page;
    page.html = exported(map, classes);
    const std::vector<std::string> headers =
        elements(page.html, "<script type=\"application/json\" id=\"map\">");
    EXPECT_EQ(headers.size(), 1u);
    page.header = json::parse(headers.at(0));
    for (const std::string& text : elements(page.html, "<script type=\"text/plain\" class=\"voxels\">")) {
      page.voxels.push_back(bytesOf(text));
    }
    for (const std::string& text : elements(page.html, "<script type=\"text/plain\" class=\"evidence\">")) {
      page.evidence.push_back(bytesOf(text));
    }
    EXPECT_EQ(page.voxels.size(), page.header["tiles"].size());
    EXPECT_EQ(page.evidence.size(), page.header["tiles"].size());
    return page;
  }
  static GridIndex indexOf(const json& tile) {
    return {tile["index"][0].get<int>(), tile["index"][1].get<int>(), tile["index"][2].get<int>()};
  }
  /// Calls visit(voxel, {state, label, occupancy, class probability, drive}) for all voxels of a page.
  template <typename Visit>
  static void forEachVoxel(const Page& page, const Visit& visit) {
    const auto planes = page.header["planes"].get<std::size_t>();
    for (std::size_t t = 0; t < page.voxels.size(); ++t) {
      const json& tile = page.header["tiles"][t];
      const auto blocks = tile["blocks"].get<std::size_t>();
      const std::string bytes = inflated(page.voxels[t], blocks * (2 + planes * kBlockVoxels));
      const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(bytes[i]); };
      for (std::size_t b = 0; b < blocks; ++b) {
        const int number = byte(2 * b) | byte(2 * b + 1) << 8;
        const BlockIndex index = Region(indexOf(tile)).blockIndex(number);
        for (std::size_t v = 0; v < kBlockVoxels; ++v) {
          std::array<unsigned, 5> values{};
          for (std::size_t p = 0; p < planes; ++p) {
            values[p] = byte(2 * blocks + (p * blocks + b) * kBlockVoxels + v);
          }
          visit(GridGeometry::voxelOf(index, static_cast<int>(v)), values);
        }
      }
    }
  }
  /// The evidence in a page, as a map.
  static SemanticMap evidenceOf(const Page& page) {
    SemanticMap map = infoOf().emptyMap();
    TileCodec codec(*infoOf().classes, TileLayout::kNoLooks);
    for (std::size_t t = 0; t < page.evidence.size(); ++t) {
      const json& tile = page.header["tiles"][t];
      TileEntry entry{indexOf(tile), tile["evidence_blocks"], tile["evidence_planes"]};
      const auto* const bytes = reinterpret_cast<const unsigned char*>(page.evidence[t].data());
      entry.checksum = tile["evidence_checksum"];
      EXPECT_EQ(codec.unpack({entry.index}, entry, bytes, page.evidence[t].size()), "");
      codec.addTo(map, {entry.index});
    }
    return map;
  }

  TemporaryFolder folder_;
  HtmlOptions options_;
};

void expectSame(const VoxelView& view, const std::array<unsigned, 5>& found, const VoxelIndex& voxel) {
  const auto where = [&] { return testing::Message() << voxel.x << " " << voxel.y << " " << voxel.z; };
  ASSERT_EQ(found[0], static_cast<unsigned>(view.state)) << where();
  const bool known = view.state != VoxelState::kUnknown, occupied = view.state == VoxelState::kOccupied;
  ASSERT_EQ(found[1], known ? view.label : 0u) << where();
  constexpr float kHalf = 0.5f / 255.0f + 1e-5f;
  ASSERT_NEAR(static_cast<float>(found[2]) / 255.0f, known ? view.occupancy : 0.0f, kHalf) << where();
  ASSERT_NEAR(static_cast<float>(found[3]) / 255.0f, occupied ? view.class_probability : 0.0f, kHalf)
      << where();
}

TEST_F(HtmlExport, HasWhatTheMapSaysOfEachVoxel) {
  const SemanticMap map = someMap();
  const Page page = read(map);
  std::size_t known = 0, known_in_map = 0;
  std::map<std::string, std::size_t> states;
  forEachVoxel(page, [&](const VoxelIndex& voxel, const std::array<unsigned, 5>& found) {
    const Block* const block = map.find(GridGeometry::blockOf(voxel));
    ASSERT_NE(block, nullptr);
    expectSame(viewWithoutEntropy(map, kRules, voxel), found, voxel);
    known += found[0] != 0;
    ++states[std::array{"unknown", "free", "occupied", "occluded"}[found[0]]];
  });
  for (const auto& [index, block] : map.entries()) {
    for (int v = 0; v < kBlockVoxels; ++v) {
      known_in_map += viewVoxel(map, kRules, index, *block, v).state != VoxelState::kUnknown;
    }
  }
  EXPECT_EQ(known, known_in_map);
  for (const char* const state : {"free", "occupied", "occluded"}) {
    EXPECT_GT(states[state], 0u) << state;
    EXPECT_EQ(page.header["voxels"][state], states[state]) << state;
  }
}

TEST_F(HtmlExport, HasTheEvidenceToTheBit) {
  const SemanticMap map = someMap();
  SemanticMap expected = infoOf().emptyMap();
  for (const auto& [index, block] : map.entries()) {
    BlockView view;
    readBlock(map, kRules, index, *block, BlockFields::kStates, view);
    // Blocks without a known voxel are not in the page.
    if (std::any_of(view.state.begin(), view.state.end(),
                    [](VoxelState s) { return s != VoxelState::kUnknown; })) {
      expected.getOrAllocate(index) = *block;
    }
  }
  EXPECT_TRUE(sameEvidence(evidenceOf(read(map)), expected));
}

TEST_F(HtmlExport, LeavesOutStatesWithTheirEvidence) {
  const SemanticMap map = someMap();
  options_.states = {VoxelState::kOccupied};
  const Page page = read(map);
  const SemanticMap evidence = evidenceOf(page);
  std::size_t occupied = 0;
  forEachVoxel(page, [&](const VoxelIndex& voxel, const std::array<unsigned, 5>& found) {
    const Block* const block = map.find(GridGeometry::blockOf(voxel));
    const Block* const kept = evidence.find(GridGeometry::blockOf(voxel));
    const int offset = GridGeometry::offsetInBlock(voxel);
    const VoxelView view = viewWithoutEntropy(map, kRules, voxel);
    ASSERT_EQ(found[0], view.state == VoxelState::kOccupied ? 2u : 0u);
    occupied += found[0] == 2;
    for (const ClassId id : block->classes()) {
      const EvidenceUnits* const units = kept ? kept->evidence(id) : nullptr;
      ASSERT_EQ(units ? std::max(units[offset], 0) : 0,  // negative evidence counts as none
                found[0] == 2 ? std::max(block->evidence(id)[offset], 0) : 0);
    }
  });
  EXPECT_GT(occupied, 0u);
  EXPECT_EQ(page.header["voxels"]["occupied"], occupied);
  EXPECT_EQ(page.header["voxels"]["free"], 0);
}

TEST_F(HtmlExport, CountsClassesAndBounds) {
  const SemanticMap map = someMap();
  const Page page = read(map);
  std::map<int, std::size_t> voxels;
  std::array<std::set<int>, 3> places;
  forEachVoxel(page, [&](const VoxelIndex& voxel, const std::array<unsigned, 5>& found) {
    if (found[0] == 2) ++voxels[static_cast<int>(found[1])];
    if (found[0] == 0) return;
    places[0].insert(voxel.x);
    places[1].insert(voxel.y);
    places[2].insert(voxel.z);
  });
  ASSERT_EQ(page.header["classes"].size(), 3u);
  for (const json& c : page.header["classes"]) EXPECT_EQ(c["voxels"], voxels[c["id"]]) << c;
  EXPECT_EQ(page.header["classes"][0]["color"], (json{140, 140, 140}))
      << "unlabelled, which the table colours";
  for (std::size_t a = 0; a < 3; ++a) {
    EXPECT_EQ(page.header["bounds"]["min"][a], *places[a].begin());
    EXPECT_EQ(page.header["bounds"]["max"][a], *places[a].rbegin());
  }
  EXPECT_EQ(page.header["resolution"], 0.3);
  EXPECT_EQ(page.header["prior"], 0.001);
  EXPECT_EQ(page.header["planes"], 4) << "without drives to tell apart";
}

TEST_F(HtmlExport, TextOfTheMapCannotBecomePartOfThePage) {
  const std::string hostile = "</script><script>alert(1)</script><!-- & \xff\xe2\x80\xa8'\"";
  std::vector<SemanticClass> classes = infoOf().classes->classes();
  classes[0].name = hostile;
  options_.name = options_.frame = hostile;
  options_.drives = {driveOf(hostile), driveOf("b")};
  options_.drives[0].name = hostile;
  options_.trajectories = {{hostile, {Eigen::Vector3d(1.0, 2.0, 3.0004)}}};
  const Page page = read(someMap(), ClassTable("t", classes));
  EXPECT_EQ(page.html.find("alert(1)</script>"), std::string::npos);
  EXPECT_EQ(page.html.find("</script><script>alert"), std::string::npos);
  const std::string shown = "</script><script>alert(1)</script><!-- & \xef\xbf\xbd\xe2\x80\xa8'\"";
  EXPECT_EQ(page.header["classes"][0]["name"], shown);
  EXPECT_EQ(page.header["name"], shown);
  EXPECT_EQ(page.header["frame"], shown);
  EXPECT_EQ(page.header["drives"][0]["id"], shown);
  EXPECT_EQ(page.header["drives"][0]["name"], shown);
  EXPECT_EQ(page.header["trajectories"][0]["name"], shown);
  EXPECT_EQ(page.header["trajectories"][0]["points"], json::parse("[[1.0, 2.0, 3.0]]"));
  // As many elements begin as end: that of three.js, too, which holds the end of one.
  const auto count = [&](const std::string& word) {
    std::size_t found = 0;
    for (std::size_t at = 0; (at = page.html.find(word, at)) != std::string::npos; ++at) ++found;
    return found;
  };
  EXPECT_EQ(count("</script>"), 8 + 2 * page.voxels.size());
  EXPECT_EQ(count("<script src"), 0u) << "the page loads nothing";
  EXPECT_EQ(count("Permission is hereby granted"), 1u) << "the license of three.js";
}

TEST_F(HtmlExport, TellsDrivesApart) {
  const SemanticMap a = randomMap(5, 40, 4), b = randomMap(6, 40, 4), c = randomMap(7, 40, 4);
  SemanticMap sum = infoOf().emptyMap();
  for (const SemanticMap* const each : {&a, &b, &c}) sum.add(*each);
  // The third drive is in the sum only; the box of a fourth, which added nothing, is elsewhere.
  std::vector<DriveRecord> drives = {driveOf("a", 1), driveOf("b", 2), driveOf("c"), driveOf("d")};
  drives[2].bounds = {Eigen::Vector3d::Constant(-100.0), Eigen::Vector3d(0.0, 100.0, 100.0)};
  drives[3].bounds = {Eigen::Vector3d(0.0, -100.0, -100.0), Eigen::Vector3d::Constant(100.0)};
  const std::string path = folder_ / "map.bkm";
  NewMapFile created(path, infoOf());
  const SemanticMap* const parts[] = {&sum, &a, &b};
  for (int part = 0; part < 3; ++part) {
    for (const GridIndex& tile : tilesOf(*parts[part]))
      created.content().writeTile(*parts[part], {tile, part});
  }
  for (const DriveRecord& drive : drives) created.content().putDrive(drive);
  created.commit();
  MapFile file(path, MapFile::Access::kRead);
  options_.drives = file.drives();
  options_.parts = &file;
  const Page page = read(sum);
  ASSERT_EQ(page.header["planes"], 5);
  std::array<std::size_t, 5> found_drives{};
  forEachVoxel(page, [&](const VoxelIndex& voxel, const std::array<unsigned, 5>& found) {
    if (found[0] == 0) return;
    const auto evidenceIn = [&](const SemanticMap& map) {
      const Block* const block = map.find(GridGeometry::blockOf(voxel));
      std::int64_t units = 0;
      for (const ClassId id : block ? block->classes() : ClassList()) {
        if (id == kFreeClass && found[0] == 2) continue;
        units += std::max(block->evidence(id)[GridGeometry::offsetInBlock(voxel)], 0);
      }
      return units;
    };
    const std::int64_t of_a = evidenceIn(a), of_b = evidenceIn(b), rest = evidenceIn(sum) - of_a - of_b;
    unsigned expected = 0;
    if (rest > std::max(of_a, of_b)) {
      expected = voxel.x < 0 ? 3 : 4;
    } else if (of_a > 0 || of_b > 0) {
      expected = of_b > of_a ? 2 : 1;
    }
    ASSERT_EQ(found[4], expected) << voxel.x << " " << voxel.y << " " << voxel.z << " " << of_a << " " << of_b
                                  << " " << rest;
    ++found_drives[found[4]];
  });
  for (std::size_t d = 1; d < 5; ++d) EXPECT_GT(found_drives[d], 0u) << d;
}

TEST_F(HtmlExport, RefusesWhatNoBrowserCanShow) {
  const std::string path = folder_ / "map.html";
  const auto refused = [&](const SemanticMap& map) {
    return refusalOf<std::invalid_argument>(
        [&] { exportHtml(path, map, kRules, *infoOf().classes, options_); });
  };
  EXPECT_EQ(refused(infoOf().emptyMap()), "there is no voxel to show; check --box and --include");
  SemanticMap wide = infoOf().emptyMap(), large = infoOf().emptyMap();
  const std::vector<EvidenceUnits> plane(kBlockVoxels, 1);
  wide.getOrAllocate({{0, 0, 0}}).add(0, plane.data());
  wide.getOrAllocate({{0, 0, 1 << 17}}).add(0, plane.data());
  EXPECT_EQ(
      refused(wide),
      "the map is 1,048,584 voxels long, but a page can show 1,048,576; export a part of it with --box, or "
      "leave out free space with --include occupied");
  for (int n = 0; n <= static_cast<int>(kMostHtmlVoxels) / kBlockVoxels; ++n) {
    large.getOrAllocate({{n % 200, n / 200, 0}}).add(0, plane.data());
  }
  EXPECT_EQ(
      refused(large),
      "the map has 20,000,256 voxels, but a page can show 20,000,000; export a part of it with --box, or "
      "leave out free space with --include occupied");
  EXPECT_EQ(folder_.fileCount(), 1u) << "only three.js";
}

TEST_F(HtmlExport, SaysWhatToInstall) {
  options_.three_js = folder_ / "none.js";
  const std::string sentence = "three.js is not in " + options_.three_js;
  EXPECT_EQ(refusalOf<std::runtime_error>([&] { checkHtml(options_); }), sentence);
  EXPECT_EQ(refusalOf<std::runtime_error>([&] { exported(someMap(), *infoOf().classes); }), sentence);
  EXPECT_EQ(folder_.fileCount(), 1u);
}

TEST(TrajectoryFile, HasThePlacesOfPoses) {
  const TemporaryFolder folder;
  const auto read = [&](const std::string& text) {
    std::ofstream(folder / "poses.txt") << text;
    return readTrajectory(folder / "poses.txt");
  };
  const Trajectory trajectory = read("# stamp x y z\n1.5 1 -2 3e0 0 0 0 1\n\n2 4 5 6\n");
  EXPECT_EQ(trajectory.name, "poses.txt");
  ASSERT_EQ(trajectory.points.size(), 2u);
  EXPECT_EQ(trajectory.points[0], Eigen::Vector3d(1.0, -2.0, 3.0));
  EXPECT_EQ(trajectory.points[1], Eigen::Vector3d(4.0, 5.0, 6.0));
  const auto sentence = [&](const std::string& text) {
    return refusalOf<std::runtime_error>([&] { read(text); });
  };
  const std::string path = folder / "poses.txt";
  for (const char* matrix : {"0 -1 0 1 1 0 0 -2 0 0 1 3", "0 -1 0 1 1 0 0 -2 0 0 1 3 0 0 0 1"}) {
    const Trajectory rows = read(matrix + std::string("\n# comment\n") + matrix + "\n");
    ASSERT_EQ(rows.points.size(), 2u);
    EXPECT_EQ(rows.points[1], Eigen::Vector3d(1.0, -2.0, 3.0));
  }
  EXPECT_EQ(read("1.5 1 -2 3 0 0 0 0\n").points.size(), 1u) << "a trajectory needs no rotations";
  EXPECT_EQ(sentence("1 2 3 4\n1 2 x 4\n"), path + " line 2: 'x' is not a finite number");
  EXPECT_EQ(sentence("1 2 3 nan\n"), path + " line 1: 'nan' is not a finite number");
  EXPECT_EQ(sentence("# x y z\n1 2 3\n"),
            path + " line 2 has 3 numbers, but needs 12 (3x4), 16 (4x4) or 8 (seconds x y z qx qy qz qw)");
  EXPECT_EQ(sentence("1 2 3 4\n1 0 0 0 0 1 0 0 0 0 1 0\n"),
            path + " line 2 has 12 numbers, but needs 4, as the lines before it");
  EXPECT_EQ(sentence("# nothing\n"), "the trajectory " + path + " has no pose");
  EXPECT_EQ(refusalOf<std::runtime_error>([&] { readTrajectory(folder / "none"); }),
            (folder / "none") + " cannot be read; give a file of poses, or the folder of a sequence");
}

}  // namespace
}  // namespace bki_mapping
