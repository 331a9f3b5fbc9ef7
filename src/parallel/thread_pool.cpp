#include "parallel/thread_pool.h"

#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <utility>

namespace bki_mapping {
namespace {

/// How long an idle thread spins before it sleeps: longer than the serial parts of a scan's update, far
/// shorter than the time between scans.
constexpr auto kSpinTime = std::chrono::microseconds(200);

/// The gate that the calling thread passes before each job.
thread_local Gate* gate_of_thread = nullptr;

/// Spins until ready() is true or the time is up. @return ready().
template <typename Ready>
bool spinUntil(Ready&& ready) {
  const auto end = std::chrono::steady_clock::now() + kSpinTime;
  for (;;) {
    for (int n = 0; n < 64; ++n) {
      if (ready()) return true;
#if defined(__x86_64__)
      __builtin_ia32_pause();
#endif
    }
    if (std::chrono::steady_clock::now() > end) return ready();
    std::this_thread::yield();  // lets other processes use the core
  }
}

}  // namespace

int threadCount(int setting) {
  return setting > 0 ? setting : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
}

ThreadPool::ThreadPool(int setting)
    : ranges_(static_cast<std::size_t>(threadCount(setting))), process_(getpid()) {
  for (int worker = 1; worker < threadCount(setting); ++worker) {
    helpers_->threads.emplace_back([this, worker] { help(static_cast<std::size_t>(worker)); });
  }
}

ThreadPool::~ThreadPool() {
  if (getpid() != process_) {  // a child would wait without end for threads that it does not have
    static_cast<void>(helpers_.release());
    return;
  }
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  helpers_->begun.notify_all();
  for (std::thread& helper : helpers_->threads) helper.join();
}

void ThreadPool::work(std::size_t worker) {
  try {
    for (std::size_t s = 0; s < ranges_.size(); ++s) {
      JobRange& range = ranges_[(worker + s) % ranges_.size()];
      for (std::size_t j = range.next++; j < range.end; j = range.next++) {
        if (gate_of_thread != nullptr) gate_of_thread->pass();
        call_(callable_, j, worker);
      }
    }
  } catch (...) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!failure_) failure_ = std::current_exception();
    for (JobRange& range : ranges_) range.next = range.end;
  }
}

void ThreadPool::help(std::size_t worker) {
  for (std::uint64_t seen = 0;;) {
    const auto ready = [&] { return stop_ || round_ != seen; };
    if (!spinUntil(ready)) {
      std::unique_lock<std::mutex> lock(mutex_);
      helpers_->begun.wait(lock, ready);
    }
    if (stop_) return;
    seen = round_;
    work(worker);
    if (--busy_ == 0) {
      const std::lock_guard<std::mutex> lock(mutex_);
      helpers_->finished.notify_one();
    }
  }
}

void ThreadPool::run(std::size_t jobs, std::size_t parts, Call call, void* callable) {
  if (jobs == 0) return;
  call_ = call;
  callable_ = callable;
  for (std::size_t s = 0; s < ranges_.size(); ++s) {
    ranges_[s].next = std::min(s, parts) * jobs / parts;
    ranges_[s].end = std::min(s + 1, parts) * jobs / parts;
  }
  if (jobs > 1 && !helpers_->threads.empty() && getpid() == process_) {
    busy_ = helpers_->threads.size();
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      ++round_;
    }
    helpers_->begun.notify_all();
    work(0);
    const auto done = [&] { return busy_ == 0; };
    if (!spinUntil(done)) {
      std::unique_lock<std::mutex> lock(mutex_);
      helpers_->finished.wait(lock, done);
    }
  } else {
    work(0);
  }
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
}

void yieldToOtherThreads(Gate* gate) {
  gate_of_thread = gate;
  constexpr int kNiceness = 19;  // the most
  // On Linux, niceness is a property of the thread, although POSIX speaks of the process.
  setpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)), kNiceness);
}

}  // namespace bki_mapping
