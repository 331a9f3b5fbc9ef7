#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "refusal_of.h"

namespace bki_mapping {
namespace {

TEST(ClassFilter, KnowsNamesAndIds) {
  SemanticClass road, car;
  road.id = 4;
  road.name = "road";
  car.id = 9;
  car.name = "car";
  const ClassTable table("toy", {road, car});
  EXPECT_EQ(ClassFilter::of(table, {"car"}), ClassFilter({9}));
  EXPECT_EQ(ClassFilter::allBut({9}).size(), kMaxClasses - 1);
  EXPECT_FALSE(ClassFilter::all().contains(kFreeClass));
  EXPECT_EQ((ClassFilter{9, 4}).ids(), (std::vector<ClassId>{4, 9}));
  EXPECT_THROW(ClassFilter{254}, std::invalid_argument);
  EXPECT_EQ(refusalOf([&] {
              ClassFilter::of(table, {"rode", "car", "cat"});
            }),
            "class table 'toy' has no class 'rode', 'cat'; it has: road, car");
}

}  // namespace
}  // namespace bki_mapping
