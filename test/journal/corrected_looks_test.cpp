// Looks that are made anew where scans move, whatever is kept of the moves, and whatever comes meanwhile.
#include "journal/corrected_looks.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "journal/corrected.h"

namespace bki_mapping {
namespace {

TEST(CorrectedLooks, TheMemoryForLooksChangesNoBit) {
  for (const std::size_t bytes : {0, 1, 200'000}) {
    MapCorrector::Settings settings = exactSettings();
    settings.looks_memory = bytes;
    expectTheMapOfTheCorrectedPoses(std::to_string(bytes) + " bytes for looks", withRules(), settings);
  }
}

/// Scans whose looks are not kept are read again, and looked through.
TEST(CorrectedLooks, WithLessMemoryForLooksMoreScansAreLookedThrough) {
  constexpr std::size_t kScans = 24;
  const auto lookedThrough = [&](std::size_t bytes) {
    MapCorrector::Settings settings = exactSettings();
    settings.memory = 1;
    settings.looks_memory = bytes;
    std::mt19937 random(21);
    Corrected map(withRules(), settings, true);
    const Keyframes moved = addStreet(map, kScans, random);
    map.finish();  // packs
    map.correct(moved);
    map.finish();
    EXPECT_EQ(map.corrector_.progress().moved, kScans);
    EXPECT_TRUE(map.content() == map.wanted(random)) << bytes;
    return map.fetched_.load();
  };
  const std::size_t all = lookedThrough(0), some = lookedThrough(50'000);
  EXPECT_GE(all, 2 * (kScans - 1));  // to be moved, and to be looked through; the last one is in memory
  EXPECT_LT(some, all);
  EXPECT_LT(lookedThrough(MovedLooks::kMostBytes), some);
}

/// Another path comes while scans far from the robot move, or when all have moved and the looks there are
/// made.
TEST(CorrectedLooks, APathThatComesBeforeFarLooksAreMadeWins) {
  constexpr std::size_t kScans = 16;
  std::size_t while_looking = 0;
  for (const std::size_t bytes : {std::size_t{0}, MovedLooks::kMostBytes}) {
    for (const auto& [moves, updates] : {std::pair(8, 0), {16, 0}, {16, 2}}) {
      MapCorrector::Settings settings = exactSettings();
      settings.looks_memory = bytes;
      std::mt19937 random(22);
      Corrected map(withRules(), settings);
      const Keyframes first = addStreet(map, kScans, random);
      map.finish();  // packs
      map.correct(first);
      const Eigen::Vector3d robot = first.back().motion.translation();
      const auto update = [&] {
        map.corrector_.update(robot);
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      };
      while (map.corrector_.progress().moved < static_cast<std::size_t>(moves)) update();
      for (int n = 0; n < updates; ++n) update();
      const MapCorrector::Progress progress = map.corrector_.progress();
      while_looking += progress.to_go == 0 && !progress.done;
      Keyframes second;
      for (std::size_t n = 0; n < first.size(); ++n) {  // some stay
        second.push_back(first[n]);
        if (n % 3 > 0) second.back().motion.translation().y() -= 1.7;
      }
      map.correct(second);
      map.corrector_.finish(robot);
      ASSERT_TRUE(map.corrector_.progress().done);
      ASSERT_TRUE(map.content() == map.wanted(random))
          << bytes << " bytes, after " << moves << " moves and " << updates << " updates";
    }
  }
  EXPECT_GE(while_looking, 2u);
}

}  // namespace
}  // namespace bki_mapping
