#include "ros/recent_map.h"

#include <gtest/gtest.h>

#include <future>
#include <new>

namespace bki_mapping::ros_interface {
namespace {

/// A mapper whose map has as many blocks as it has mapped scans, with a mapping thread that the test plays.
class RecentMapTest : public testing::Test {
 protected:
  RecentMap::Shared take(const QueriedMap* earlier) {
    if (no_memory_) throw std::bad_alloc();
    ++taken_;
    if (!earlier)
      return std::make_shared<const QueriedMap>(std_msgs::Header(),
                                                bki_mapping::MapSnapshot{map_.snapshot(), {}}, classes_);
    return std::make_shared<const QueriedMap>(
        std_msgs::Header(), bki_mapping::MapSnapshot{map_.snapshot(), {}}, classes_, *earlier);
  }
  void mapScan(RecentMap& recent) {
    map_.getOrAllocate({{scans_++, 0, 0}});
    recent.changed();
  }
  /// Asks in another thread, while this one serves the mapping queue.
  RecentMap::Shared askAndServe(RecentMap& recent) {
    auto asked = std::async(std::launch::async, [&] { return recent.get(); });
    while (asked.wait_for(std::chrono::milliseconds(1)) != std::future_status::ready)
      mapping_.callAvailable();
    return asked.get();
  }
  RecentMap make(RecentMap::Clock::duration interest) {
    return RecentMap([this](const QueriedMap* earlier) { return take(earlier); }, mapping_, background_,
                     interest);
  }

  const ClassTable classes_{"one", {SemanticClass()}};
  SemanticMap map_{GridGeometry(1.0), 0.001, 1};
  ros::CallbackQueue mapping_, background_;
  int scans_ = 0, taken_ = 0;
  bool no_memory_ = false;
};

TEST_F(RecentMapTest, IsTakenOnlyWhileQueriesAreAsked) {
  RecentMap recent = make(std::chrono::hours(1));
  for (int n = 0; n < 3; ++n) mapScan(recent);
  EXPECT_EQ(taken_, 0);
  EXPECT_EQ(askAndServe(recent)->map.size(), 3u);
  EXPECT_EQ(taken_, 1);
  mapScan(recent);
  recent.releaseIfIdle();
  EXPECT_EQ(taken_, 2);
  // Nobody serves the mapping queue: it maps a scan.
  EXPECT_EQ(recent.get()->map.size(), 4u);
  EXPECT_EQ(recent.get().get(), recent.get().get());
}

TEST_F(RecentMapTest, IsGivenUpAndFreedInTheBackground) {
  RecentMap recent = make(std::chrono::seconds(-1));  // idle at once
  std::weak_ptr<const QueriedMap> kept = askAndServe(recent);
  EXPECT_FALSE(kept.expired());
  mapScan(recent);
  EXPECT_EQ(taken_, 1);
  EXPECT_FALSE(kept.expired());
  background_.callAvailable();
  EXPECT_TRUE(kept.expired());
  kept = askAndServe(recent);
  EXPECT_EQ(taken_, 2);
  recent.releaseIfIdle();
  background_.callAvailable();
  EXPECT_TRUE(kept.expired());
}

TEST_F(RecentMapTest, IsNeverOlderThanTheLastChange) {
  RecentMap recent = make(std::chrono::hours(1));
  askAndServe(recent);
  no_memory_ = true;
  mapScan(recent);  // must not throw: the scan is in the map
  EXPECT_THROW(askAndServe(recent), std::bad_alloc);
  no_memory_ = false;
  EXPECT_EQ(askAndServe(recent)->map.size(), 1u);
}

TEST_F(RecentMapTest, TakesOverWhatQueriesHaveFoundOut) {
  RecentMap recent = make(std::chrono::hours(1));
  mapScan(recent);
  RecentMap::Shared asked = askAndServe(recent);
  const BlockStates* const decided = asked->states.find({{0, 0, 0}});
  mapScan(recent);
  EXPECT_EQ(recent.get()->states.find({{0, 0, 0}}), decided);
  const std::weak_ptr<const QueriedMap> before = asked;
  asked = nullptr;
  background_.callAvailable();
  EXPECT_TRUE(before.expired()) << "a snapshot must not keep earlier ones";
}

TEST_F(RecentMapTest, FindsFrontiersAheadOfQueriesThatAskForThem) {
  const auto isPrepared = [](const QueriedMap& of) {
    for (std::uint32_t position = 0; position < of.map.regionCount(); ++position) {
      if (!of.states.keptFrontiers(position)) return false;
    }
    return true;
  };
  RecentMap recent = make(std::chrono::hours(1));
  mapScan(recent);
  askAndServe(recent);
  mapScan(recent);
  background_.callAvailable();
  EXPECT_FALSE(isPrepared(*recent.get())) << "nobody has asked for frontiers";
  EXPECT_FALSE(isPrepared(*recent.getForFrontiers()));
  mapScan(recent);
  const RecentMap::Shared passed = recent.get();
  mapScan(recent);
  background_.callAvailable();
  EXPECT_TRUE(isPrepared(*recent.get()));
  EXPECT_FALSE(isPrepared(*passed)) << "a newer snapshot took its place";
}

}  // namespace
}  // namespace bki_mapping::ros_interface
