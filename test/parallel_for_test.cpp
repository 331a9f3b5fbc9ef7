// Workers do every job once, pass on what jobs throw, and go on.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>
#include <vector>

#include "bki_mapping/inference/parallel_for.h"

namespace bki_mapping {
namespace {

TEST(Workers, DoEachJobOnceRoundAfterRound) {
  for (const int threads : {1, 2, 5}) {
    Workers workers(threads);
    EXPECT_EQ(workers.count(), static_cast<std::size_t>(threads));
    for (std::size_t round = 0; round < 300; ++round) {
      std::vector<std::atomic<int>> done(round % 70);
      std::atomic<bool> known_worker{true};
      workers.forEach(done.size(), [&](std::size_t job, std::size_t worker) {
        ++done[job];
        if (worker >= workers.count()) known_worker = false;
      });
      for (const auto& times : done) ASSERT_EQ(times, 1) << threads << " threads, round " << round;
      ASSERT_TRUE(known_worker);
    }
  }
}

TEST(Workers, PassOnWhatAJobThrowsAndGoOn) {
  Workers workers(3);
  for (int time = 0; time < 20; ++time) {
    const auto job = [](std::size_t j, std::size_t) {
      if (j == 7) throw std::runtime_error("job 7");
    };
    EXPECT_THROW(workers.forEach(100, job), std::runtime_error);
    std::atomic<int> done{0};
    workers.forEach(50, [&](std::size_t, std::size_t) { ++done; });
    EXPECT_EQ(done, 50);
  }
}

TEST(Workers, WakeFromSleep) {
  Workers workers(2);
  for (int time = 0; time < 5; ++time) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    std::atomic<int> done{0};
    workers.forEach(10, [&](std::size_t, std::size_t) { ++done; });
    EXPECT_EQ(done, 10);
  }
}

}  // namespace
}  // namespace bki_mapping
