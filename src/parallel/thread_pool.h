/// @file A thread pool for independent jobs: the only code of the core that starts threads.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>
#include <type_traits>
#include <vector>

#include "parallel/gate.h"

namespace bki_mapping {

/// @return the number of threads that a setting selects: the setting itself, or all cores for 0.
int threadCount(int setting);

/// Alignment of per-thread data [bytes], which avoids false sharing. Two cache lines, since some processors
/// fetch lines in pairs.
constexpr std::size_t kThreadsApart = 128;

/// A fixed set of threads. Idle threads spin for a moment, so that the next call starts fast, then sleep. A
/// process forks without them: in the child, the calling thread does all jobs.
class ThreadPool {
 public:
  /// @param setting number of threads, the caller's among them; 0 means all cores.
  explicit ThreadPool(int setting);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  /// Threads that take jobs, the caller's among them.
  std::size_t count() const { return helpers_->threads.size() + 1; }

  /// Calls job(j, worker) for each j in [0, jobs), and returns when all are done. Jobs must be independent of
  /// each other; `worker` in [0, count()) identifies the thread. Each thread starts with its own consecutive
  /// range of jobs, so that a job of the next call finds its data in the same core's cache, and then takes
  /// jobs from the others' ranges. Allocates no memory. Must not be called from two threads at once, nor
  /// from a job.
  /// @throws what the first failing job threw; jobs that have not started by then are skipped.
  template <typename Job>
  void forEach(std::size_t jobs, Job&& job) {
    runAny(jobs, count(), job);
  }
  /// The same, but jobs start in order, each on the next free thread. Use it for jobs sorted by falling cost.
  template <typename Job>
  void forEachInOrder(std::size_t jobs, Job&& job) {
    runAny(jobs, 1, job);
  }

 private:
  using Call = void (*)(void* callable, std::size_t job, std::size_t worker);

  template <typename Job>
  void runAny(std::size_t jobs, std::size_t parts, Job& job) {
    run(
        jobs, parts,
        [](void* callable, std::size_t j, std::size_t worker) { (*static_cast<Job*>(callable))(j, worker); },
        const_cast<void*>(static_cast<const void*>(&job)));
  }
  /// @param parts number of ranges into which the jobs are split, at most one for each worker.
  void run(std::size_t jobs, std::size_t parts, Call call, void* callable);
  void work(std::size_t worker);
  void help(std::size_t worker);

  /// A range of consecutive jobs. Worker n starts with range n.
  struct alignas(kThreadsApart) JobRange {
    std::atomic<std::size_t> next{0};  ///< first job that no worker has taken; may exceed `end`
    std::size_t end = 0;
  };

  // The current call of run(); written before `round_` is incremented, which publishes them.
  Call call_ = nullptr;
  void* callable_ = nullptr;
  std::vector<JobRange> ranges_;  ///< one for each worker

  std::atomic<std::size_t> busy_{0};     ///< helpers that have not finished this round
  std::atomic<std::uint64_t> round_{0};  ///< incremented by each call that needs the helpers
  std::atomic<bool> stop_{false};
  /// The threads but for the caller's, and what they and it wait for.
  struct Helpers {
    std::vector<std::thread> threads;
    std::condition_variable begun, finished;
  };

  std::mutex mutex_;  ///< guards `failure_` and the two conditions
  std::exception_ptr failure_;
  std::unique_ptr<Helpers> helpers_ = std::make_unique<Helpers>();
  pid_t process_;  ///< that has the helpers
};

/// Gives other threads of the process priority over the calling one: publishing and corrections may wait, a
/// scan may not. @param gate that it passes before each job of a ThreadPool, from now on; must outlive the
/// thread. A core that is shared by two threads is slower for both, whatever their priorities are.
void yieldToOtherThreads(Gate* gate = nullptr);

}  // namespace bki_mapping
