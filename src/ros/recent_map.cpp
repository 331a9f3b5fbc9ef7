#include "ros/recent_map.h"

#include <new>

#include "ros/queued_call.h"

namespace bki_mapping::ros_interface {
namespace {

/// Frees a snapshot in the thread that calls it: this takes long if the map has changed much since.
class Release : public ros::CallbackInterface {
 public:
  explicit Release(RecentMap::Shared snapshot) : snapshot_(std::move(snapshot)) {}
  CallResult call() override {
    snapshot_.reset();
    return Success;
  }

 private:
  RecentMap::Shared snapshot_;
};

}  // namespace

RecentMap::Shared RecentMap::get() {
  last_asked_ = Clock::now();
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
    keep(idle() ? nullptr : take_(earlier));
  } catch (const std::exception&) {
    keep(nullptr);  // the next query asks again, and its answer says why there is none
  }
}

void RecentMap::releaseIfIdle() noexcept {
  if (idle()) keep(nullptr);
}

void RecentMap::keep(Shared snapshot) noexcept {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    kept_.swap(snapshot);
  }
  if (!snapshot) return;
  try {
    freeing_.addCallback(ros::CallbackInterfacePtr(new Release(std::move(snapshot))));
  } catch (const std::bad_alloc&) {  // then it is freed here
  }
}

}  // namespace bki_mapping::ros_interface
