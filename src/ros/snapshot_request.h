/// @file Lets other threads ask the mapping thread for a snapshot of the map.
#pragma once

#include <ros/callback_queue.h>

#include <exception>
#include <functional>
#include <future>
#include <memory>
#include <utility>

#include "ros/map_snapshot.h"

namespace bki_mapping::ros_interface {

/// Makes a snapshot between two scans, in the thread that serves the callback queue of the mapper.
class SnapshotRequest : public ros::CallbackInterface {
 public:
  using Make = std::function<MapSnapshot()>;

  explicit SnapshotRequest(Make make) : make_(std::move(make)) {}

  CallResult call() override {
    try {
      answer_.set_value(std::make_shared<const MapSnapshot>(make_()));
    } catch (...) {
      answer_.set_exception(std::current_exception());
    }
    return Success;
  }

  /// Waits until the queue has served a request. @param make called in the thread that serves the queue.
  /// @throws what make() throws, and std::future_error if the queue is cleared instead.
  static std::shared_ptr<const MapSnapshot> ask(ros::CallbackQueue& queue, Make make) {
    boost::shared_ptr<SnapshotRequest> request(new SnapshotRequest(std::move(make)));
    auto answer = request->answer_.get_future();
    queue.addCallback(request);
    request.reset();  // the queue's alone, so that clearing the queue ends the wait
    return answer.get();
  }

 private:
  Make make_;
  std::promise<std::shared_ptr<const MapSnapshot>> answer_;
};

}  // namespace bki_mapping::ros_interface
