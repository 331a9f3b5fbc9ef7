// Looks are a function of the set of scans: compared with a slow reference that keeps every scan.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <random>

#include "bki_mapping/map/looks.h"

namespace bki_mapping {
namespace {

/// What one scan saw of each voxel of a block.
struct SeenScan {
  std::uint64_t tick;
  std::array<Sight, kBlockVoxels> sights;

  Look look() const {
    Look::Voxels crossed, voids, hit;
    for (std::size_t v = 0; v < kBlockVoxels; ++v) {
      crossed[v] = sights[v] == Sight::kCrossed;
      voids[v] = sights[v] == Sight::kVoid;
      hit[v] = sights[v] == Sight::kHit;
    }
    return {tick, crossed, voids, hit};
  }
};

/// The definition: the interval of a tick is the smallest of 2^level ticks that is, or comes right before,
/// that of the same length in which the newest tick lies.
std::pair<std::uint64_t, unsigned> intervalOf(std::uint64_t newest, std::uint64_t tick) {
  for (unsigned level = 0;; ++level) {
    const std::uint64_t length = std::uint64_t{1} << level;
    if (newest / length - tick / length <= 1) return {tick / length * length, level};
  }
}

/// All looks at once, from the set of scans.
std::vector<Look> expectedLooks(const std::vector<SeenScan>& scans) {
  std::uint64_t newest = 0;
  for (const SeenScan& scan : scans) newest = std::max(newest, scan.tick);
  std::map<std::pair<std::uint64_t, unsigned>, std::array<Sight, kBlockVoxels>> sights;
  for (const SeenScan& scan : scans) {
    auto& of_interval = sights[intervalOf(newest, scan.tick)];
    for (std::size_t v = 0; v < kBlockVoxels; ++v) of_interval[v] = std::max(of_interval[v], scan.sights[v]);
  }
  std::vector<Look> looks;
  for (const auto& [interval, of_voxels] : sights) {
    Look::Voxels low, high;
    for (std::size_t v = 0; v < kBlockVoxels; ++v) {
      low[v] = (static_cast<int>(of_voxels[v]) & 1) != 0;
      high[v] = (static_cast<int>(of_voxels[v]) & 2) != 0;
    }
    looks.emplace_back(interval.first, interval.second, low, high);
  }
  return looks;
}

/// @param longest time between scans [ticks].
std::vector<SeenScan> randomScans(std::size_t count, std::uint64_t longest, std::mt19937_64& random) {
  std::vector<SeenScan> scans;
  std::uint64_t tick = random() % (std::uint64_t{1} << 36) / 2;
  for (std::size_t n = 0; n < count; ++n) {
    tick += random() % (longest + 1);
    SeenScan scan{tick, {}};
    for (Sight& sight : scan.sights) sight = static_cast<Sight>(random() % 4);
    scans.push_back(scan);
  }
  return scans;
}

Looks looksOf(const std::vector<SeenScan>& scans) {
  Looks looks;
  for (const SeenScan& scan : scans) looks.add(scan.look());
  return looks;
}

TEST(Looks, AreAFunctionOfTheSetOfScans) {
  std::mt19937_64 random(1);
  for (const std::uint64_t longest : {0u, 1u, 3u, 40u, 1000u, 5000000u}) {
    for (std::size_t count = 1; count < 60; count += 7) {
      std::vector<SeenScan> scans = randomScans(count, longest, random);
      const std::vector<Look> expected = expectedLooks(scans);
      EXPECT_TRUE(looksOf(scans).all() == expected) << count << " scans, in order";
      for (int round = 0; round < 5; ++round) {
        std::shuffle(scans.begin(), scans.end(), random);
        const Looks looks = looksOf(scans);
        ASSERT_TRUE(looks.all() == expected) << count << " scans, shuffled";
        EXPECT_TRUE(looks.isCanonical());
        const auto middle = scans.begin() + static_cast<std::ptrdiff_t>(random() % (count + 1));
        Looks sum = looksOf({middle, scans.end()});
        sum.add(looksOf({scans.begin(), middle}));
        ASSERT_TRUE(sum.all() == expected) << count << " scans, merged";
      }
    }
  }
}

TEST(Looks, GrowWithTheLogarithmOfTime) {
  Looks looks;
  Look::Voxels one;
  one[5] = true;
  constexpr std::uint64_t kFirst = 123456789;
  for (std::uint64_t tick = kFirst; tick < kFirst + 20000; ++tick) looks.add(Look(tick, one, {}, {}));
  EXPECT_LE(looks.all().size(), 2u + 15u);  // 2^15 > 20000
  EXPECT_EQ(looks.all().back().begin(), kFirst + 19999);
  EXPECT_EQ(looks.all().back().level(), 0u);
}

TEST(Looks, AddAllocatesNothingAfterReserve) {
  std::mt19937_64 random(2);
  Looks looks;
  for (const SeenScan& scan : randomScans(200, 5, random)) {
    looks.reserveTick(scan.tick);
    const std::size_t bytes = looks.bytes();
    looks.add(scan.look());
    EXPECT_EQ(looks.bytes(), bytes);
  }
}

TEST(Looks, AreStoredWithoutTheLayersThatNobodySaw) {
  Looks looks;
  Look::Voxels low, high;
  low[3] = low[63] = low[64 * 7 + 5] = high[64 * 7 + 5] = true;
  looks.add(Look(1000, 0, low, high));
  looks.add(Look(1001, 0, low, high));
  looks.shrink();
  EXPECT_EQ(looks.bytes(), 2 * (1 + 3) * sizeof(std::uint64_t));
  for (const StoredLook& look : looks) {
    for (std::size_t v = 0; v < kBlockVoxels; ++v) {
      ASSERT_EQ(look.at(v), v == 3 || v == 63 ? Sight::kCrossed
                            : v == 64 * 7 + 5 ? Sight::kHit
                                              : Sight::kNothing)
          << v;
    }
  }
}

TEST(Looks, StoreAllLevelsAndTimesOfAnyStamp) {
  Look::Voxels all;
  all.set();
  const std::uint64_t latest = Look::tickOf(~std::uint64_t{0});
  Looks looks;
  looks.add(Look(0, 0, all, all));
  looks.add(Look(latest, 0, all, {}));
  EXPECT_TRUE(looks.isCanonical());
  EXPECT_TRUE(looks.all() == (std::vector<Look>{Look(0, 35, all, all), Look(latest, 0, all, {})}));
}

TEST(Looks, KeepLittleOfTheMemoryThatTheyNoLongerNeed) {
  std::mt19937_64 random(4);
  Looks looks;
  std::uint64_t tick = 1 << 20;
  for (int round = 0; round < 20; ++round) {
    for (const SeenScan& scan : randomScans(1 + random() % 10, 2, random)) {
      Look::Voxels hit;
      hit[random() % kBlockVoxels] = true;
      tick += 1 + random() % 300;
      looks.reserveTick(tick);
      looks.add(round % 2 == 0 ? Look(tick, scan.look().low(), scan.look().high(), {})
                               : Look(tick, {}, {}, hit));
    }
    const Looks before = looks;
    looks.reserveTick(++tick);
    EXPECT_TRUE(looks == before);
    EXPECT_LE(looks.bytes(), before.bytes() + (17 + 16) * sizeof(std::uint64_t));
  }
}

TEST(Looks, ForgetNothingButTheErasedVoxels) {
  std::mt19937_64 random(3);
  std::vector<SeenScan> scans = randomScans(20, 4, random);
  Looks looks = looksOf(scans);
  Look::Voxels erased;
  for (std::size_t v = 0; v < kBlockVoxels; v += 3) erased[v] = true;
  looks.erase(erased);
  for (SeenScan& scan : scans) {
    for (std::size_t v = 0; v < kBlockVoxels; v += 3) scan.sights[v] = Sight::kNothing;
  }
  EXPECT_TRUE(looks.all() == expectedLooks(scans));
  // What only the latest scan saw is gone; its time remains, so that the intervals are those of the set of
  // scans.
  Look::Voxels one, other;
  one[7] = other[8] = true;
  Looks few;
  few.add(Look(1000, one, {}, {}));
  few.add(Look(2000, other, {}, {}));
  few.erase(other);
  EXPECT_TRUE(few.isCanonical());
  EXPECT_EQ(few.all()[0].level(), Looks::levelAt(2000, 1000));
  EXPECT_TRUE(few.all()[0].seen()[7]);
  looks.erase(~Look::Voxels());
  EXPECT_TRUE(looks.empty());
}

TEST(Looks, KnowWhatNoMapWrites) {
  Look::Voxels some;
  some[1] = true;
  const auto isCanonical = [](std::initializer_list<Look> looks) {
    Looks all;
    for (const Look& look : looks) all.append(look);
    return all.isCanonical();
  };
  EXPECT_TRUE(isCanonical({}));
  EXPECT_TRUE(isCanonical({Look(12, 2, some, {}), Look(17, 0, some, some), Look(18, 0, {}, some)}));
  EXPECT_FALSE(isCanonical({Look(18, 0, {}, some), Look(17, 0, some, some)})) << "out of order";
  EXPECT_FALSE(isCanonical({Look(17, 0, some, some), Look(17, 0, some, some)})) << "twice";
  EXPECT_FALSE(isCanonical({Look(12, 1, some, {}), Look(18, 0, {}, some)})) << "too fine";
  EXPECT_FALSE(isCanonical({Look(13, 2, some, {}), Look(18, 0, {}, some)})) << "no multiple";
  EXPECT_FALSE(isCanonical({Look(16, 1, some, {})})) << "the latest is no tick";
  EXPECT_FALSE(isCanonical({Look(12, 0, {}, {})})) << "nothing seen";
  EXPECT_FALSE(isCanonical({Look(~std::uint64_t{0}, 0, some, {})})) << "beyond all stamps";
}

}  // namespace
}  // namespace bki_mapping
