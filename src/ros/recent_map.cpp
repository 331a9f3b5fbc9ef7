#include "ros/recent_map.h"

#include <new>

#include "bki_mapping/query/queries.h"
#include "ros/queued_call.h"

namespace bki_mapping::ros_interface {
namespace {

/// A function that the thread of a queue calls.
class Call : public ros::CallbackInterface {
 public:
  explicit Call(std::function<void()> function) : function_(std::move(function)) {}
  CallResult call() override {
    function_();
    return Success;
  }

 private:
  std::function<void()> function_;
};

}  // namespace

template <typename Function>
void RecentMap::later(Function function) noexcept {
  try {
    background_.addCallback(ros::CallbackInterfacePtr(new Call(std::move(function))));
  } catch (const std::bad_alloc&) {
  }
}

RecentMap::Shared RecentMap::get() {
  asked_ = Clock::now();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (kept_) return kept_;
  }
  return QueuedCall<Shared>::ask(mapping_, [this] {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (kept_) return kept_;  // another query has asked meanwhile
    }
    Shared taken = take_(nullptr);
    keep(taken);
    return taken;
  });
}

void RecentMap::changed() noexcept {
  const QueriedMap* earlier;  // only this thread replaces it
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    earlier = kept_.get();
  }
  if (!earlier) return;
  try {
    Shared taken = isRecent(asked_) ? take_(earlier) : nullptr;
    keep(taken);
    if (taken && isRecent(frontiers_asked_)) later([this, taken] { prepare(taken); });
  } catch (const std::exception&) {
    keep(nullptr);  // the next query asks again, and its answer says why there is none
  }
}

void RecentMap::releaseIfIdle() noexcept {
  if (!isRecent(asked_)) keep(nullptr);
}

void RecentMap::keep(Shared snapshot) noexcept {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    kept_.swap(snapshot);
  }
  // Freeing takes long if the map has changed much since.
  if (snapshot) later([freed = std::move(snapshot)]() mutable { freed.reset(); });
}

void RecentMap::prepare(const Shared& snapshot) {
  try {
    prepareFrontiers(snapshot->states, [&] {
      const std::lock_guard<std::mutex> lock(mutex_);
      return kept_ == snapshot;
    });
  } catch (const std::bad_alloc&) {  // then queries find them, or say why not
  }
}

}  // namespace bki_mapping::ros_interface
