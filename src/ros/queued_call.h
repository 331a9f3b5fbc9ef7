/// @file Calls that other threads make in the mapping thread.
#pragma once

#include <ros/callback_queue.h>

#include <exception>
#include <functional>
#include <future>
#include <utility>

namespace bki_mapping::ros_interface {

/// A call that is made between two scans, in the thread that serves the callback queue of the mapper.
template <typename Answer>
class QueuedCall : public ros::CallbackInterface {
 public:
  using Make = std::function<Answer()>;

  explicit QueuedCall(Make make) : make_(std::move(make)) {}

  CallResult call() override {
    try {
      answer_.set_value(make_());
    } catch (...) {
      answer_.set_exception(std::current_exception());
    }
    return Success;
  }

  /// Waits until the queue has served the call. @return the answer of make(), which is called in the thread
  /// that serves the queue. @throws what make() throws, and std::future_error if the queue is cleared
  /// instead.
  static Answer ask(ros::CallbackQueue& queue, Make make) {
    boost::shared_ptr<QueuedCall> request(new QueuedCall(std::move(make)));
    std::future<Answer> answer = request->answer_.get_future();
    queue.addCallback(request);
    request.reset();  // only the queue owns it now, so that clearing the queue ends the wait
    return answer.get();
  }

 private:
  Make make_;
  std::promise<Answer> answer_;
};

/// Has the thread that serves a queue go on, should it wait for a call.
inline void wake(ros::CallbackQueue& queue) {
  struct Nothing : ros::CallbackInterface {
    CallResult call() override { return Success; }
  };
  queue.addCallback(ros::CallbackInterfacePtr(new Nothing));
}

}  // namespace bki_mapping::ros_interface
