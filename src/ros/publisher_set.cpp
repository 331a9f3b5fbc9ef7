#include "ros/publisher_set.h"

#include <algorithm>
#include <utility>

#include "parallel/thread_pool.h"
#include "rules/neighbourhood.h"

namespace bki_mapping::ros_interface {
namespace {

/// Longest wait for something to publish or a new subscriber [s].
constexpr double kIdleWait = 0.1;

/// Ends the wait for callbacks.
struct Wake : ros::CallbackInterface {
  CallResult call() override { return Success; }
};

}  // namespace

std::chrono::duration<double> publishPeriod(double rate, std::chrono::duration<double> took) {
  constexpr double kMaxFraction = 0.1;  // of the time
  return std::max(std::chrono::duration<double>(1.0 / rate), took / kMaxFraction);
}

PublisherSet::PublisherSet(const ros::NodeHandle& node, const ServerConfig& config,
                           TakeSnapshot take_snapshot)
    : node_(node), take_snapshot_(std::move(take_snapshot)) {
  node_.setCallbackQueue(&queue_);
  publishers_ = makePublishers({node_, config, [this] { return takeSnapshot(); }});
}

void PublisherSet::start() {
  running_ = true;
  thread_ = std::thread(&PublisherSet::work, this);
}

void PublisherSet::stop() {
  if (!running_) return;
  running_ = false;
  wake();
  thread_.join();
}

void PublisherSet::wake() {
  queue_.addCallback(ros::CallbackInterfacePtr(new Wake));
}

void PublisherSet::changed(const std::vector<GridIndex>& blocks) {
  if (blocks.empty()) return;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    changed_.add(blocks);
  }
  wake();
}

void PublisherSet::closeChanges() {
  const std::lock_guard<std::mutex> lock(mutex_);
  closed_.add(changed_);
  changed_.clear();
  closed_start_over_ = closed_start_over_ || start_over_;
  start_over_ = false;
}

void PublisherSet::startOver() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    start_over_ = true;
  }
  wake();
}

void PublisherSet::work() {
  yieldToOtherThreads();
  while (running_) {
    queue_.callAvailable(ros::WallDuration(kIdleWait));
    publishDue();
  }
}

std::shared_ptr<const ServerSnapshot> PublisherSet::takeSnapshot() {
  std::shared_ptr<const ServerSnapshot> snapshot = take_snapshot_();
  ChangedBlocks closed;
  bool start_over = false;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::swap(closed, closed_);
    std::swap(start_over, closed_start_over_);
  }
  if (!closed.all() && !closed.empty()) {
    const std::vector<GridIndex>& blocks = closed.blocks();
    closed.add(withDependents(snapshot->map, snapshot->rules, {blocks.data(), blocks.size()}));
  }
  for (const auto& publisher : publishers_) {
    if (!publisher->wanted()) {
      publisher->rest();
      continue;
    }
    publisher->changed.add(closed);
    if (start_over) publisher->startOver();
  }
  return snapshot;
}

std::vector<MapPublisher*> PublisherSet::findDue() {
  const std::lock_guard<std::mutex> lock(mutex_);
  const bool any_change = start_over_ || closed_start_over_ || !changed_.empty() || !closed_.empty();
  bool any_wanted = false;
  std::vector<MapPublisher*> due;
  for (const auto& publisher : publishers_) {
    if (!publisher->wanted()) {
      publisher->rest();
      continue;
    }
    any_wanted = true;
    if ((any_change || !publisher->changed.empty()) && Clock::now() >= publisher->next) {
      due.push_back(publisher.get());
    }
  }
  if (!any_wanted) {
    changed_.clear();
    closed_.clear();
    start_over_ = closed_start_over_ = false;
  }
  return due;
}

void PublisherSet::publishDue() {
  const std::vector<MapPublisher*> due = findDue();
  if (due.empty()) return;
  std::shared_ptr<const ServerSnapshot> snapshot;
  due.front()->tryTo([&] { snapshot = takeSnapshot(); });
  if (!snapshot) return;
  for (MapPublisher* publisher : due) {
    if (publisher->changed.empty()) continue;
    const auto start = Clock::now();
    publisher->tryTo([&] { publisher->publish(*snapshot); });
    publisher->next = start + std::chrono::duration_cast<Clock::duration>(
                                  publishPeriod(snapshot->config.publish_rate, Clock::now() - start));
  }
}

}  // namespace bki_mapping::ros_interface
