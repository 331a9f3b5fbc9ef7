// Class tables: those of the package, and the messages for faulty ones.
#include <gtest/gtest.h>

#include <fstream>
#include <map>

#include "bki_mapping/settings/yaml.h"
#include "refusal_of.h"
#include "temporary_folder.h"

namespace bki_mapping {
namespace {

/// The message of the exception when a table with this text is loaded.
std::string faultOf(const std::string& text) {
  const TemporaryFolder folder;
  const std::string file = folder / "file.yaml";
  std::ofstream(file) << text;
  return refusalOf([&] { loadClassTable(file); });
}

#define EXPECT_NAMES(message, words) EXPECT_NE((message).find(words), std::string::npos) << (message)

TEST(ClassTable, FlagsAndGainsBelongToClasses) {
  const TemporaryFolder folder;
  const std::string file = folder / "file.yaml";
  std::ofstream(file) << "classes:\n"
                         "  - {id: 0, name: a, color: [1, 2, 3], flags: [ground], free_gain: 0.5}\n"
                         "  - {id: 1, name: b, color: [1, 2, 3], flags: [ignored, dynamic]}\n"
                         "  - {id: 2, name: c, color: [1, 2, 3], flags: [living]}\n"
                         "  - {id: 4, name: d, color: [1, 2, 3], flags: [airborne]}\n";
  const ClassTable table = loadClassTable(file);
  EXPECT_EQ(table.nameOf(1), "b");
  for (const ClassId none : {ClassId{3}, kFreeClass}) EXPECT_EQ(table.nameOf(none), "");
  EXPECT_TRUE(table.find(0)->ground && !table.find(0)->ignored && !table.find(0)->dynamic);
  EXPECT_EQ(table.find(0)->free_gain, 0.5);
  EXPECT_TRUE(table.find(1)->ignored && table.find(1)->dynamic && !table.find(1)->ground);
  EXPECT_FALSE(table.find(1)->free_gain || table.find(1)->living);
  EXPECT_TRUE(table.find(2)->living && table.find(2)->dynamic) << "what lives can move";
  EXPECT_TRUE(table.find(4)->airborne && !table.find(4)->dynamic && !table.find(2)->airborne);
  const std::string head = "classes:\n  - {id: 0, name: a, color: [1, 2, 3], ";
  EXPECT_NAMES(faultOf(head + "flags: [ground, ignored]}\n"), "both ground and ignored");
  EXPECT_NAMES(faultOf(head + "flags: [ground, airborne]}\n"), "both ground and airborne");
  EXPECT_NAMES(faultOf(head + "free_gain: 0}\n"), "free_gain of class 'a' must be a number > 0");
}

TEST(ClassTable, GroundMayCost) {
  const TemporaryFolder folder;
  const std::string file = folder / "file.yaml";
  std::ofstream(file) << "classes:\n"
                         "  - {id: 0, name: road, color: [1, 2, 3], flags: [ground]}\n"
                         "  - {id: 1, name: grass, color: [1, 2, 3], flags: [ground], cost: 60}\n"
                         "  - {id: 2, name: water, color: [1, 2, 3], flags: [ground], cost: 100}\n"
                         "  - {id: 3, name: wall, color: [1, 2, 3], cost: 0}\n";
  const ClassTable table = loadClassTable(file);
  for (const auto& [id, cost] : {std::pair(0, 0), std::pair(1, 60), std::pair(2, 100), std::pair(3, 0)}) {
    EXPECT_EQ(table.find(static_cast<ClassId>(id))->cost, cost);
  }
  const std::string grass = "classes:\n  - {id: 0, name: grass, color: [1, 2, 3], flags: [ground], cost: ";
  for (const char* cost : {"-1", "101", "255", "1000"}) {
    EXPECT_NAMES(faultOf(grass + cost + "}\n"),
                 std::string("the cost of class 'grass' is ") + cost + " and must be 0 to 100");
  }
  for (const char* cost : {"12.5", "high", "~", "[60]", ".nan", ".inf", "99999999999", "60 70"}) {
    EXPECT_NAMES(faultOf(grass + cost + "}\n"),
                 "the cost of class 'grass' must be a whole number from 0 to 100");
  }
  EXPECT_NAMES(faultOf("classes:\n  - {id: 0, name: wall, color: [1, 2, 3], cost: 60}\n"),
               "class 'wall' has a cost, but not the flag ground");
  EXPECT_NAMES(faultOf("classes:\n  - {id: 0, name: a, color: [1, 2, 3], costs: 60}\n"),
               "did you mean 'cost'?");
}

TEST(ClassTable, ShippedTablesGradeTheGround) {
  const std::map<std::string, std::map<std::string, int>> costs = {
      {"semantic_kitti",
       {{"road", 0}, {"parking", 0}, {"sidewalk", 30}, {"other-ground", 50}, {"terrain", 60}}},
      {"nuscenes", {{"driveable-surface", 0}, {"sidewalk", 30}, {"other-flat", 50}, {"terrain", 60}}},
      {"carla",
       {{"road", 0},
        {"road-line", 0},
        {"sidewalk", 30},
        {"ground", 50},
        {"rail-track", 50},
        {"terrain", 60}}},
      {"kitti", {{"road", 0}, {"sidewalk", 30}}},
      {"nclt", {{"road", 0}, {"sidewalk", 30}, {"terrain", 60}}},
      {"toy", {}},
      {"occupancy", {}}};
  for (const auto& [name, expected] : costs) {
    std::map<std::string, int> found;
    const ClassTable table = loadClassTable(name);
    for (const SemanticClass& c : table.classes()) {
      if (c.ground) found[c.name] = c.cost;
    }
    EXPECT_EQ(found, expected) << name;
  }
}

TEST(ClassTable, AllShippedTablesLoad) {
  const std::map<std::string, std::size_t> sizes = {{"semantic_kitti", 20}, {"nuscenes", 17}, {"carla", 23},
                                                    {"kitti", 12},          {"nclt", 14},     {"toy", 4},
                                                    {"occupancy", 1}};
  for (const auto& [name, size] : sizes) {
    const ClassTable table = loadClassTable(name);
    EXPECT_EQ(table.name(), name);
    EXPECT_EQ(table.size(), size) << name;
    EXPECT_EQ(table.unlabelled().has_value(), name != "occupancy") << name;
  }
}

TEST(ClassTable, SemanticKittiLearningMap) {
  const ClassTable table = loadClassTable("semantic_kitti");
  const std::map<std::uint32_t, int> expected = {
      {0, 0},   {1, 0},   {52, 0},  {99, 0},  {10, 1},  {252, 1}, {11, 2},  {15, 3},  {18, 4},
      {258, 4}, {13, 5},  {16, 5},  {20, 5},  {256, 5}, {257, 5}, {259, 5}, {30, 6},  {254, 6},
      {31, 7},  {253, 7}, {32, 8},  {255, 8}, {40, 9},  {60, 9},  {44, 10}, {48, 11}, {49, 12},
      {50, 13}, {51, 14}, {70, 15}, {71, 16}, {72, 17}, {80, 18}, {81, 19}};
  for (const auto& [raw, id] : expected) EXPECT_EQ(table.classOfRaw(raw), id) << raw;
  EXPECT_FALSE(table.classOfRaw(2).has_value());
  EXPECT_TRUE(table.find(1)->dynamic);
  EXPECT_FALSE(table.find(9)->dynamic);
}

TEST(ClassTable, RawNumbersMayBeLarge) {
  SemanticClass small, large;
  small.name = "small";
  small.raw = {0, 4095, 7};
  large.id = 1;
  large.name = "large";
  large.raw = {4096, 70000, 4294967295u};
  const ClassTable table("numbers", {small, large});
  for (const std::uint32_t raw : small.raw) EXPECT_EQ(table.classOfRaw(raw), 0) << raw;
  for (const std::uint32_t raw : large.raw) EXPECT_EQ(table.classOfRaw(raw), 1) << raw;
  for (const std::uint32_t raw : {1u, 4094u, 4097u, 69999u}) EXPECT_FALSE(table.classOfRaw(raw)) << raw;
}

TEST(LabelMask, LeavesTheBitsOfTheClass) {
  SemanticClass car, road;
  car.name = "car";
  car.raw = {10, 252};
  road.id = 40;
  road.name = "road";
  road.raw = {4000};
  const ClassTable table("instances", {car, road}, 0xffff);
  EXPECT_EQ(table.labelMask(), 0xffffu);
  for (const std::uint32_t instance : {0u, 1u, 300u, 0x7fffu, 0x8001u, 0xffffu}) {
    EXPECT_EQ(table.classOfRaw(instance << 16 | 10u), 0) << instance;
    EXPECT_EQ(table.classOfRaw(instance << 16 | 4000u), 40) << instance;
    EXPECT_FALSE(table.classOfRaw(instance << 16 | 11u)) << instance;
    EXPECT_EQ(table.classOf(instance << 16 | 40u, LabelValues::kId), 40) << instance;
    EXPECT_FALSE(table.classOf(instance << 16 | 4000u, LabelValues::kId)) << instance;
  }
  EXPECT_FALSE(ClassTable("plain", {car, road}).classOfRaw(1u << 16 | 10u)) << "by default, all bits count";
  SemanticClass high = car;
  high.raw = {0x0a0000, 0x280000};
  road.raw = {0x140000};
  const ClassTable upper("upper", {high, road}, 0xff0000);
  EXPECT_EQ(upper.classOfRaw(0xff0affffu), 0);
  EXPECT_EQ(upper.classOf(40, LabelValues::kId), 40) << "an id is one whatever the mask";
}

TEST(LabelMask, DoesNotReachPointsWithoutALabel) {
  SemanticClass none, low;
  none.name = "none";
  none.raw = {0, 255};
  low.id = 1;
  low.name = "low";
  low.raw = {0xffff};
  EXPECT_FALSE(ClassTable("bytes", {none}, 0xff).classOfRaw(kNoLabel)) << "-1 is not 255";
  EXPECT_FALSE(ClassTable("words", {low}, 0xffff).classOfRaw(kNoLabel));
  EXPECT_FALSE(ClassTable("words", {low}, 0xffff).classOf(kNoLabel, LabelValues::kId));
  none.raw = {0, kNoLabel};
  EXPECT_EQ(ClassTable("listed", {none, low}, 0xffff).classOfRaw(kNoLabel), 0) << "unless it is listed";
  EXPECT_EQ(loadClassTable("occupancy").classOfRaw(kNoLabel), 0);
}

TEST(LabelMask, ComesFromTheFile) {
  const TemporaryFolder folder;
  const std::string file = folder / "file.yaml";
  const std::string head = "classes:\n  - {id: 1, name: a, color: [1, 2, 3], raw: [-1, 200]}\n";
  for (const auto& [text, mask] :
       {std::pair("", 0xffffffffu), std::pair("label_mask: 0xFFFF\n", 0xffffu),
        std::pair("label_mask: 255\n", 255u), std::pair("label_mask: 4294967295\n", 0xffffffffu)}) {
    std::ofstream(file) << text << head;
    const ClassTable table = loadClassTable(file);
    EXPECT_EQ(table.labelMask(), mask) << text;
    EXPECT_EQ(table.classOfRaw(kNoLabel), 1) << text;
  }
  for (const char* wrong : {"0", "-1", "4294967296"}) {
    EXPECT_NAMES(faultOf(std::string("label_mask: ") + wrong + "\n" + head),
                 std::string("label_mask ") + wrong + " of the table is not in 1 to 4294967295");
  }
  for (const char* wrong : {"0xGG", "low", "1.5", "[1]"}) {
    EXPECT_NAMES(faultOf(std::string("label_mask: ") + wrong + "\n" + head), "bad conversion");
  }
  EXPECT_NAMES(faultOf("label_mask: 0x7F\n" + head),
               "raw label 200 of class 'a' has bits that label_mask 0x7F leaves out");
  EXPECT_NAMES(faultOf("labelmask: 0x7F\n" + head), "did you mean 'label_mask'?");
}

// Of the data sets, SemanticKITTI alone has instances in its labels; the other formats keep them elsewhere.
TEST(LabelMask, OfShippedTables) {
  ASSERT_EQ(classTableNames().size(), 7u);
  for (const std::string& name : classTableNames()) {
    EXPECT_EQ(loadClassTable(name).labelMask(), name == "semantic_kitti" ? 0xffffu : 0xffffffffu) << name;
  }
}

TEST(ClassTable, OccupancyTakesEveryLabel) {
  const ClassTable table = loadClassTable("occupancy");
  for (const std::uint32_t raw : {0u, 40u, 252u, 70000u}) EXPECT_EQ(table.classOfRaw(raw), 0);
}

TEST(ClassTable, AnyCountUpTo254) {
  std::vector<SemanticClass> classes(254);
  for (std::size_t i = 0; i < classes.size(); ++i) {
    classes[i].id = static_cast<ClassId>(i);
    classes[i].name = "c" + std::to_string(i);
  }
  EXPECT_EQ(ClassTable("many", classes).size(), 254u);
  classes.emplace_back();
  classes.back().id = 254;
  EXPECT_NAMES(refusalOf([&] { ClassTable("too many", classes); }), "more than 254");
}

TEST(ClassTable, NamesEveryFault) {
  const std::string head = "classes:\n  - {id: 1, name: a, color: [1, 2, 3]}\n";
  EXPECT_EQ(faultOf(head), "");
  EXPECT_NAMES(refusalOf([] { loadClassTable("semantic_kiti"); }), "did you mean 'semantic_kitti'?");
  EXPECT_NAMES(refusalOf([] { loadClassTable("/no/such/file.yaml"); }), "/no/such/file.yaml");
  EXPECT_NAMES(faultOf(head + "  - {id: 1, name: b, color: [1, 2, 3], raw: [9]}\n"), "id 1 is given twice");
  EXPECT_NAMES(faultOf(head + "  - {id: 2, name: a, color: [1, 2, 3], raw: [9]}\n"),
               "name 'a' is given twice");
  EXPECT_NAMES(faultOf(head + "  - {id: 2, name: b, color: [1, 2, 3], raw: [1]}\n"),
               "raw label 1 is given twice");
  EXPECT_NAMES(faultOf(head + "  - {id: 2, name: b, colour: [1, 2, 3]}\n"), "did you mean 'color'?");
  EXPECT_NAMES(faultOf(head + "  - {id: 2, name: b, color: [1, 2]}\n"), "not [red, green, blue]");
  EXPECT_NAMES(faultOf(head + "  - {id: 300, name: b, color: [1, 2, 3]}\n"), "300");
  EXPECT_NAMES(faultOf(head + "  - {id: 254, name: b, color: [1, 2, 3]}\n"), "254 is above 253");
  EXPECT_NAMES(faultOf(head + "  - {id: 2, name: b, color: [1, 2, 3], flags: [dynamik]}\n"),
               "did you mean 'dynamic'?");
  EXPECT_NAMES(faultOf(head + "  - {id: two, name: b, color: [1, 2, 3]}\n"), "bad conversion");
  EXPECT_NAMES(faultOf(head + "  - {name: b, color: [1, 2, 3]}\n"), "no 'id'");
  EXPECT_NAMES(faultOf(head + "  - {id: 2, name: b, color: [1, 2, 3], flags: dynamic}\n"),
               "the flags of class 'b' must be a list; write [dynamic]");
  EXPECT_NAMES(faultOf(head + "  - {id: 2, name: b, color: [1, 2, 3], flags: {dynamic: true}}\n"),
               "the flags of class 'b' must be a list");
  EXPECT_NAMES(faultOf(head + "  - {id: 2, name: '', color: [1, 2, 3]}\n"), "class 2 is empty");
  EXPECT_NAMES(faultOf(head + "  - {id: 2, name: ~, color: [1, 2, 3]}\n"), "class 2 is empty");
  EXPECT_NAMES(faultOf(head + "  - {id: 2, name: b, color: [1, 2, 3], raw: 9}\n"),
               "raw of class 'b' must be a list of numbers, or any");
  for (const char* raw : {"-2", "4294967296"}) {
    EXPECT_NAMES(faultOf(head + "  - {id: 2, name: b, color: [1, 2, 3], raw: [" + raw + "]}\n"),
                 std::string("raw label ") + raw + " of class 'b' is not in -1 to 4294967295");
  }
  EXPECT_NAMES(faultOf(head + "  - {id: 2, name: b, color: [1, 2, 3], raw: [x]}\n"), "bad conversion");
  for (const char* gain : {".inf", ".nan", "-.inf", "-1", "0"}) {
    EXPECT_NAMES(faultOf(head + "  - {id: 2, name: b, color: [1, 2, 3], free_gain: " + gain + "}\n"),
                 "free_gain of class 'b' must be a number > 0");
  }
  EXPECT_NAMES(faultOf(head + "  - {id: 2, name: b, color: [1, 2, 3], id: 3}\n"), "'id' is given twice");
  EXPECT_NAMES(faultOf(head + "  - some text\n"), "class 2 of the list is not a map");
  EXPECT_NAMES(faultOf(head + "nmae: garden\n"), "'nmae' of the table is unknown; did you mean 'name'?");
  EXPECT_NAMES(faultOf("name: ''\n" + head), "the name of the table is empty");
  EXPECT_NAMES(faultOf("classs:\n  - {id: 1, name: a, color: [1, 2, 3]}\n"), "did you mean 'classes'?");
  EXPECT_NAMES(faultOf(head + head), "'classes' is given twice");
  EXPECT_NAMES(faultOf("classes: []\n"), "no class");
  EXPECT_NAMES(faultOf("just text"), "list 'classes'");
  EXPECT_NAMES(faultOf("classes: [\n"), "class table");
}

}  // namespace
}  // namespace bki_mapping
