/// @file Independent jobs on several threads; the only place that starts threads in the core.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <type_traits>
#include <vector>

namespace bki_mapping {

/// @return the number of threads meant by a setting: itself, or all cores if it is 0.
int threadCount(int setting);

/// What one thread writes while others are at work stands in cache lines of its own: so many bytes apart,
/// since some processors fetch lines in pairs.
constexpr std::size_t kThreadsApart = 128;

/// Threads that wait for work. Between two pieces of work they stay awake for a moment, then sleep.
class ThreadPool {
 public:
  /// @param setting number of threads, the caller's among them; 0 means all cores.
  explicit ThreadPool(int setting);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  /// Threads that take jobs, the caller's among them.
  std::size_t count() const { return helpers_.size() + 1; }

  /// Calls job(j, worker) for each j in [0, jobs); returns when all are done. Jobs must not depend on each
  /// other. `worker` in [0, count()) tells threads apart; each begins with a consecutive share of the jobs,
  /// so that the same job of two calls finds its data in the same core's cache, and then helps the others.
  /// Allocates no memory. Not to be called from two threads at once, nor from a job.
  /// @throws what the first failing job threw; jobs not yet begun are then left out.
  template <typename Job>
  void forEach(std::size_t jobs, Job&& job) {
    runAny(jobs, count(), job);
  }
  /// The same, but whoever is free takes the next job in order: for jobs sorted by effort, largest first.
  template <typename Job>
  void forEachInOrder(std::size_t jobs, Job&& job) {
    runAny(jobs, 1, job);
  }

 private:
  using Call = void (*)(void* callable, std::size_t job, std::size_t worker);

  template <typename Job>
  void runAny(std::size_t jobs, std::size_t shares, Job& job) {
    run(
        jobs, shares,
        [](void* callable, std::size_t j, std::size_t worker) { (*static_cast<Job*>(callable))(j, worker); },
        const_cast<void*>(static_cast<const void*>(&job)));
  }
  /// @param shares into which jobs are split, at most one a worker.
  void run(std::size_t jobs, std::size_t shares, Call call, void* callable);
  void work(std::size_t worker);
  void help(std::size_t worker);

  /// Consecutive jobs. Each worker begins with the share of its number.
  struct alignas(kThreadsApart) Share {
    std::atomic<std::size_t> next{0};  ///< first job that nobody has taken; may pass `end`
    std::size_t end = 0;
  };

  // Of the work at hand; written before `round_` goes up.
  Call call_ = nullptr;
  void* callable_ = nullptr;
  std::vector<Share> shares_;  ///< one a worker

  std::atomic<std::size_t> busy_{0};     ///< helpers that have not finished this round
  std::atomic<std::uint64_t> round_{0};  ///< goes up with each piece of work
  std::atomic<bool> stop_{false};
  std::mutex mutex_;  ///< of the two conditions and of `failure_`
  std::condition_variable begun_, finished_;
  std::exception_ptr failure_;
  std::vector<std::thread> helpers_;
};

}  // namespace bki_mapping
