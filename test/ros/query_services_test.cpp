// What the services answer beyond the queries themselves, which test/query tests.
#include "refusal_of.h"
#include "ros/queries/queries.h"

#include <gtest/gtest.h>

#include <chrono>
#include <stdexcept>
#include <string>
#include <vector>

namespace bki_mapping::ros_interface {
namespace {

SemanticClass classOf(ClassId id, const std::string& name) {
  SemanticClass result;
  result.id = id;
  result.name = name;
  return result;
}

ClassTable table() {
  std::vector<SemanticClass> classes = {classOf(0, "sky"), classOf(1, "road"), classOf(2, "wall"),
                                        classOf(3, "car"), classOf(4, "person")};
  classes[0].ignored = true;
  classes[1].ground = true;
  classes[3].dynamic = true;
  classes[4].dynamic = classes[4].living = true;
  return ClassTable("street", classes);
}

/// A block in which voxel n of the first row is of class n, up to `last`, and all others are free.
SemanticMap rowOfClasses(std::size_t last) {
  SemanticMap map(GridGeometry(1.0), 0.001, 5);
  Block& block = map.getOrAllocate({});
  std::vector<EvidenceUnits> plane(kBlockVoxels, unitsOf(1.0));
  block.add(kFreeClass, plane.data());
  for (std::size_t id = 0; id <= last; ++id) {
    plane.assign(kBlockVoxels, 0);
    plane[id] = unitsOf(5.0);
    block.add(static_cast<ClassId>(id), plane.data());
  }
  return map;
}

CheckSpace::Response check(std::size_t last, const std::vector<std::string>& worst_first) {
  const ClassTable classes = table();
  const QueriedMap map(std_msgs::Header(), {rowOfClasses(last), {}}, classes);
  CheckSpace::Request asked;
  asked.poses.resize(1);
  asked.poses[0].position.x = 4.0;
  asked.poses[0].position.y = asked.poses[0].position.z = 0.5;
  asked.sizes.resize(1);
  asked.sizes[0].x = 7.9;
  asked.sizes[0].y = asked.sizes[0].z = 0.5;
  asked.classes = {"sky", "road"};
  asked.all_but = true;
  asked.worst_first = worst_first;
  CheckSpace::Response answer;
  query(map, asked, answer);
  return answer;
}

TEST(CheckSpace, TheWorstClassIsTheOneThatLives) {
  const std::vector<std::string> worst = {"sky", "road", "wall", "car", "person"};
  for (std::size_t last = 0; last < worst.size(); ++last) {
    const CheckSpace::Response answer = check(last, {});
    EXPECT_EQ(answer.worst_class[0], worst[last]);
    EXPECT_EQ(answer.occupied_voxels[0], last + 1);
    EXPECT_EQ(answer.free_voxels[0], 7 - last);
    EXPECT_EQ(answer.free[0] != 0, last < 2) << "sky and road are no obstacles";
  }
  EXPECT_EQ(check(4, {"road", "car"}).worst_class[0], "road");
  EXPECT_EQ(check(0, {"road", "car"}).worst_class[0], "");
  EXPECT_THROW(check(0, {"ghost"}), std::invalid_argument);
}

TEST(CheckSpace, AllShapesOfACallCountTogether) {
  const ClassTable classes = table();
  const QueriedMap map(std_msgs::Header(), {rowOfClasses(0), {}}, classes);
  CheckSpace::Request asked;
  asked.radii = {120.0};  // some 1.4e7 voxels in the box about it
  asked.poses.resize(1);
  CheckSpace::Response answer;
  EXPECT_NO_THROW(query(map, asked, answer));
  asked.poses.resize(2);
  EXPECT_THROW(query(map, asked, answer), std::invalid_argument);
  asked.radii = {0.1};
  asked.poses.resize(CheckSpace::Request::MOST_SHAPES + 1);
  EXPECT_THROW(query(map, asked, answer), std::invalid_argument);
}

TEST(GetNearestObstacles, ACallEndsInTime) {
  // Each point takes a look at every voxel, because all have some evidence for a car, and none is one.
  const ClassTable classes = table();
  SemanticMap map(GridGeometry(1.0), 0.001, 5);
  const std::vector<EvidenceUnits> much(kBlockVoxels, unitsOf(5.0)), little(kBlockVoxels, unitsOf(1.0));
  for (int n = 0; n < 1000; ++n) {
    Block& block = map.getOrAllocate({{n % 10, n / 10 % 10, n / 100}});
    block.add(2, much.data());
    block.add(3, little.data());
  }
  const QueriedMap queried(std_msgs::Header(), {std::move(map), {}}, classes);
  GetNearestObstacles::Request asked;
  GetNearestObstacles::Response answer;
  asked.points.resize(GetNearestObstacles::Request::MOST_POINTS);
  asked.classes = {"car"};
  asked.max_distance = 4.0;
  query(queried, asked, answer);
  EXPECT_EQ(answer.distance.size(), asked.points.size());
  asked.max_distance = 0.0;
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(refusalOf([&] { query(queried, asked, answer = {}); }),
            "the call takes more than 5 s; set max_distance, or split it");
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  EXPECT_GE(took.count(), GetNearestObstacles::Request::MOST_SECONDS);
  EXPECT_LT(took.count(), GetNearestObstacles::Request::MOST_SECONDS + 5.0);
}

TEST(GetFrontiers, ListedVoxelsAreLimited) {
  // Blocks of free voxels apart from each other, whose outer voxels are frontiers: more than a million.
  const ClassTable classes = table();
  SemanticMap map(GridGeometry(1.0), 0.001, 5);
  const std::vector<EvidenceUnits> plane(kBlockVoxels, unitsOf(1.0));
  constexpr int kBlocks = 3500, kSurface = 8 * 8 * 8 - 6 * 6 * 6;
  for (int n = 0; n < kBlocks; ++n) map.getOrAllocate({{2 * n, 0, 0}}).add(kFreeClass, plane.data());
  const QueriedMap queried(std_msgs::Header(), {std::move(map), {}}, classes);
  GetFrontiers::Request asked;
  GetFrontiers::Response answer;
  query(queried, asked, answer);
  EXPECT_EQ(answer.size, std::vector<std::uint32_t>(kBlocks, kSurface));
  asked.with_voxels = true;
  EXPECT_THROW(query(queried, asked, answer = {}), std::invalid_argument);
  asked.max_count = 2;
  query(queried, asked, answer = {});
  EXPECT_EQ(answer.voxels.size(), std::size_t{2 * kSurface});
  asked.min_size = kSurface + 1;
  query(queried, asked, answer = {});
  EXPECT_TRUE(answer.centre.empty());
}

}  // namespace
}  // namespace bki_mapping::ros_interface
