// A ThreadPool does every job once, rethrows exceptions, and stays usable; threads wait at a closed gate; an
// OrderedQueue keeps the order.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <stdexcept>
#include <thread>
#include <vector>

#include "parallel/ordered_queue.h"
#include "parallel/thread_pool.h"

namespace bki_mapping {
namespace {

TEST(ThreadPool, DoesEachJobOnceRoundAfterRound) {
  for (const int threads : {1, 2, 5}) {
    ThreadPool pool(threads);
    EXPECT_EQ(pool.count(), static_cast<std::size_t>(threads));
    for (std::size_t round = 0; round < 300; ++round) {
      std::vector<std::atomic<int>> done(round % 70);
      std::atomic<bool> known_worker{true};
      pool.forEach(done.size(), [&](std::size_t job, std::size_t worker) {
        ++done[job];
        if (worker >= pool.count()) known_worker = false;
      });
      for (const auto& times : done) ASSERT_EQ(times, 1) << threads << " threads, round " << round;
      ASSERT_TRUE(known_worker);
    }
  }
}

TEST(ThreadPool, StartsEachWorkerWithItsOwnRange) {
  ThreadPool pool(2);
  for (int round = 0; round < 50; ++round) {
    std::atomic<int> begun{0};
    std::vector<std::size_t> worker_of(4);
    pool.forEach(4, [&](std::size_t job, std::size_t worker) {
      worker_of[job] = worker;
      for (++begun; begun < 2;) std::this_thread::yield();  // until both have a job
    });
    ASSERT_EQ(worker_of[0], 0u) << "round " << round;
    ASSERT_EQ(worker_of[2], 1u) << "round " << round;
  }
}

TEST(ThreadPool, StartsJobsInOrderIfAsked) {
  ThreadPool pool(2);
  for (int round = 0; round < 50; ++round) {
    std::vector<std::atomic<int>> times(40);
    std::atomic<std::size_t> begun{0};
    std::atomic<bool> in_order{true};
    pool.forEachInOrder(times.size(), [&](std::size_t job, std::size_t) {
      ++times[job];
      if (job > begun++ + 1) in_order = false;  // the other thread may be about to start the job before
    });
    ASSERT_TRUE(in_order);
    for (const auto& each : times) ASSERT_EQ(each, 1);
  }
}

TEST(ThreadPool, IdleWorkersTakeJobsFromOthers) {
  ThreadPool pool(2);
  std::atomic<bool> others_done{false};
  std::atomic<int> done{0};
  // The first job ends after all others, including those of its own range.
  pool.forEach(20, [&](std::size_t job, std::size_t) {
    if (job == 0) {
      while (!others_done) std::this_thread::yield();
    } else if (++done == 19) {
      others_done = true;
    }
  });
  EXPECT_EQ(done, 19);
}

TEST(ThreadPool, RethrowsFromJobsAndStaysUsable) {
  ThreadPool pool(3);
  for (int time = 0; time < 20; ++time) {
    const auto job = [](std::size_t j, std::size_t) {
      if (j == 7) throw std::runtime_error("job 7");
    };
    EXPECT_THROW(pool.forEach(100, job), std::runtime_error);
    std::atomic<int> done{0};
    pool.forEach(50, [&](std::size_t, std::size_t) { ++done; });
    EXPECT_EQ(done, 50);
  }
}

TEST(ThreadPool, WakesFromSleep) {
  ThreadPool pool(2);
  for (int time = 0; time < 5; ++time) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    std::atomic<int> done{0};
    pool.forEach(10, [&](std::size_t, std::size_t) { ++done; });
    EXPECT_EQ(done, 10);
  }
}

TEST(ThreadPool, AForkedProcessDoesItsJobsAlone) {
  auto pool = std::make_unique<ThreadPool>(4);
  std::atomic<int> done{0};
  const auto work = [&] { pool->forEach(100, [&](std::size_t, std::size_t) { ++done; }); };
  work();
  for (const auto pause :
       {std::chrono::milliseconds(0), std::chrono::milliseconds(20)}) {  // spinning, asleep
    std::this_thread::sleep_for(pause);
    const pid_t child = fork();
    if (child == 0) {
      alarm(10);  // rather than hang
      done = 0;
      work();
      pool.reset();
      _exit(done == 100 ? 0 : 1);
    }
    int status = -1;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
  }
  done = 0;
  work();
  EXPECT_EQ(done, 100) << "the parent still has its threads";
}

TEST(OrderedQueue, TakesEachPieceInOrderAsSoonAsPossible) {
  OrderedQueue queue;
  for (int round = 0; round < 2; ++round) {
    std::vector<std::size_t> taken;
    const auto take = [&](std::size_t piece) { taken.push_back(piece); };
    queue.start(4);
    queue.finish(1, take);
    EXPECT_EQ(taken, std::vector<std::size_t>());
    queue.finish(0, take);
    EXPECT_EQ(taken, (std::vector<std::size_t>{0, 1}));
    queue.finish(3, take);
    EXPECT_EQ(taken, (std::vector<std::size_t>{0, 1}));
    queue.finish(2, take);
    EXPECT_EQ(taken, (std::vector<std::size_t>{0, 1, 2, 3}));
  }
}

/// A thread that yields, and does jobs without end.
struct YieldingThread {
  Gate gate;
  std::atomic<int> done{0};
  std::atomic<bool> stop{false};
  std::thread thread{[this] {
    yieldToOtherThreads(&gate);
    ThreadPool pool(1);
    while (!stop) pool.forEach(1, [this](std::size_t, std::size_t) { ++done; });
  }};
  ~YieldingThread() {
    stop = true;
    thread.join();
  }
  void waitForJobs(int more) const {
    for (const int before = done; done < before + more;) std::this_thread::yield();
  }
};

TEST(Gate, AThreadThatYieldsDoesNoJobsWhileItIsClosed) {
  YieldingThread other;
  int rounds = 0, waited = 0;
  for (int round = 0; round < 5; ++round) {
    std::this_thread::sleep_for(Gate::kMostWait);  // it is patient again
    other.waitForJobs(10);
    const auto begin = std::chrono::steady_clock::now();
    const Gate::Closed closed(&other.gate);
    const int before = other.done;
    while (std::chrono::steady_clock::now() < begin + Gate::kMostWait / 2) std::this_thread::yield();
    const int after = other.done;
    // A machine that stood still proves nothing.
    if (std::chrono::steady_clock::now() < begin + Gate::kMostWait * 9 / 10) {
      ++rounds;
      waited += after <= before + 1;  // one had begun
    }
  }
  // A busy machine may have kept it from becoming patient again in one of them.
  EXPECT_GE(waited, std::min(rounds, rounds / 2 + 1));
  other.waitForJobs(10);
}

TEST(Gate, NobodyWaitsForEver) {
  YieldingThread other;
  other.waitForJobs(1);
  const Gate::Closed closed(&other.gate);
  other.waitForJobs(100);
}

TEST(OrderedQueue, KeepsTheOrderWithSeveralThreads) {
  ThreadPool pool(4);
  OrderedQueue queue;
  for (std::size_t round = 0; round < 200; ++round) {
    const std::size_t pieces = round % 40;
    std::vector<std::size_t> taken, all;
    for (std::size_t p = 0; p < pieces; ++p) all.push_back(p);
    queue.start(pieces);
    pool.forEach(pieces, [&](std::size_t piece, std::size_t) {
      queue.finish(piece, [&](std::size_t next) { taken.push_back(next); });
    });
    ASSERT_EQ(taken, all);
  }
}

}  // namespace
}  // namespace bki_mapping
