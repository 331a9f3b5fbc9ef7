// Colours of pages and pictures: people can tell the classes of every table apart.
#include "export/display_colors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <set>

#include "bki_mapping/settings/yaml.h"

namespace bki_mapping {
namespace {

/// A plain measure of what differs, other than that of the code: in red, green and blue, weighted as the eye
/// sees them.
double plainDifference(const Color& a, const Color& b) {
  const double red = a[0] - b[0], green = a[1] - b[1], blue = a[2] - b[2];
  return std::sqrt(0.3 * red * red + 0.59 * green * green + 0.11 * blue * blue);
}

TEST(DisplayColors, OfEveryTableDiffer) {
  std::size_t tables = 0;
  for (const auto& file : std::filesystem::directory_iterator(BKI_MAPPING_SOURCE_DIR "/config/classes")) {
    const ClassTable table = loadClassTable(file.path().string()), shown = displayTable(table);
    ASSERT_EQ(shown.size(), table.size());
    ++tables;
    std::set<Color> colors;
    for (std::size_t i = 0; i < shown.size(); ++i) {
      const SemanticClass &c = shown.classes()[i], &as_in_table = table.classes()[i];
      EXPECT_EQ(c.name, as_in_table.name);
      EXPECT_EQ(c.id, as_in_table.id);
      EXPECT_TRUE(colors.insert(c.color).second) << c.name;
      for (std::size_t j = 0; j < i; ++j) {
        EXPECT_GT(plainDifference(c.color, shown.classes()[j].color), 13.0)
            << file.path() << ": " << c.name << ", " << shown.classes()[j].name;
      }
    }
  }
  EXPECT_GE(tables, 7u);
}

TEST(DisplayColors, ChangeOnlyWhatIsConfusing) {
  const ClassTable table = loadClassTable("semantic_kitti"), shown = displayTable(table);
  std::set<std::string> changed;
  for (const SemanticClass& c : table.classes()) {
    if (shown.find(c.id)->color != c.color) changed.insert(c.name);
  }
  EXPECT_EQ(changed, (std::set<std::string>{"unlabelled", "traffic-sign"}));
  const Color unlabelled = shown.find(*shown.unlabelled())->color;
  EXPECT_EQ(unlabelled, (Color{140, 140, 140})) << "neither black nor striking";
  EXPECT_GT(plainDifference(shown.classes()[19].color, shown.classes()[6].color), 100.0)
      << "traffic-sign, person";
}

}  // namespace
}  // namespace bki_mapping
