#include "parallel/thread_pool.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace bki_mapping {
namespace {

/// How long a thread stays awake for the next piece of work: longer than the serial pieces of a scan, far
/// shorter than the time between scans.
constexpr auto kAwake = std::chrono::microseconds(200);

/// Waits awake until ready() or until the time is up. @return ready().
template <typename Ready>
bool awaitAwake(Ready&& ready) {
  const auto end = std::chrono::steady_clock::now() + kAwake;
  for (;;) {
    for (int n = 0; n < 64; ++n) {
      if (ready()) return true;
#if defined(__x86_64__)
      __builtin_ia32_pause();
#endif
    }
    if (std::chrono::steady_clock::now() > end) return ready();
    std::this_thread::yield();  // a core that somebody else needs is not worth holding
  }
}

}  // namespace

int threadCount(int setting) {
  return setting > 0 ? setting : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
}

ThreadPool::ThreadPool(int setting) : shares_(static_cast<std::size_t>(threadCount(setting))) {
  for (int worker = 1; worker < threadCount(setting); ++worker) {
    helpers_.emplace_back([this, worker] { help(static_cast<std::size_t>(worker)); });
  }
}

ThreadPool::~ThreadPool() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  begun_.notify_all();
  for (std::thread& helper : helpers_) helper.join();
}

void ThreadPool::work(std::size_t worker) {
  try {
    for (std::size_t s = 0; s < shares_.size(); ++s) {
      Share& share = shares_[(worker + s) % shares_.size()];
      for (std::size_t j = share.next++; j < share.end; j = share.next++) call_(callable_, j, worker);
    }
  } catch (...) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!failure_) failure_ = std::current_exception();
    for (Share& share : shares_) share.next = share.end;
  }
}

void ThreadPool::help(std::size_t worker) {
  for (std::uint64_t seen = 0;;) {
    const auto ready = [&] { return stop_ || round_ != seen; };
    if (!awaitAwake(ready)) {
      std::unique_lock<std::mutex> lock(mutex_);
      begun_.wait(lock, ready);
    }
    if (stop_) return;
    seen = round_;
    work(worker);
    if (--busy_ == 0) {
      const std::lock_guard<std::mutex> lock(mutex_);
      finished_.notify_one();
    }
  }
}

void ThreadPool::run(std::size_t jobs, std::size_t shares, Call call, void* callable) {
  if (jobs == 0) return;
  call_ = call;
  callable_ = callable;
  for (std::size_t s = 0; s < shares_.size(); ++s) {
    shares_[s].next = std::min(s, shares) * jobs / shares;
    shares_[s].end = std::min(s + 1, shares) * jobs / shares;
  }
  if (jobs > 1 && !helpers_.empty()) {
    busy_ = helpers_.size();
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      ++round_;
    }
    begun_.notify_all();
    work(0);
    const auto done = [&] { return busy_ == 0; };
    if (!awaitAwake(done)) {
      std::unique_lock<std::mutex> lock(mutex_);
      finished_.wait(lock, done);
    }
  } else {
    work(0);
  }
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
}

}  // namespace bki_mapping
