/// @file MapPublisher, the publisher of one map topic. PublisherSet owns one for each topic.
#pragma once

#include <ros/console.h>
#include <ros/node_handle.h>
#include <ros/single_subscriber_publisher.h>

#include <chrono>
#include <exception>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "parallel/index_numbering.h"
#include "ros/server_snapshot.h"

namespace bki_mapping::ros_interface {

/// The blocks that changed since the last publication.
class ChangedBlocks {
 public:
  void add(const std::vector<GridIndex>& blocks) {
    if (all_) return;
    for (const GridIndex& block : blocks) blocks_.insert(block);
  }
  void add(const ChangedBlocks& changed) { changed.all() ? addAll() : add(changed.blocks()); }
  void addAll() {
    all_ = true;
    blocks_.clear();
  }
  void clear() {
    all_ = false;
    blocks_.clear();
  }
  bool all() const { return all_; }
  bool empty() const { return !all_ && blocks_.size() == 0; }
  /// Blocks that were changed, created or erased; empty if all() is true.
  const std::vector<GridIndex>& blocks() const { return blocks_.members(); }

 private:
  IndexNumbering blocks_;
  bool all_ = false;
};

/// Publishes one topic. Builds messages only while the topic has subscribers. Runs in the thread of
/// PublisherSet.
class MapPublisher {
 public:
  virtual ~MapPublisher() = default;
  virtual bool wanted() const { return publisher_.getNumSubscribers() > 0; }
  std::string topic() const { return publisher_.getTopic(); }
  /// Publishes the changes since the last call, or the whole map, and clears `changed`.
  void publish(const ServerSnapshot& snapshot) {
    publishNew(snapshot);
    changed.clear();
  }
  /// Calls build(). If memory does not suffice for the message, logs an error and skips it: mapping goes on,
  /// and the topic is published again when it is next due.
  template <typename Build>
  void tryTo(Build&& build) {
    try {
      build();
    } catch (const std::exception& fault) {
      ROS_ERROR_THROTTLE(5.0,
                         "%s could not be published (%s): the map is too large for the memory that is left; "
                         "set view_range, window or memory_limit, or listen to the topic with updates",
                         topic().c_str(), fault.what());
    }
  }
  /// Called instead of publish while there is no subscriber.
  virtual void rest() { changed.clear(); }
  /// Requests the whole map at the next publication: settings changed, or a user asked for it.
  virtual void startOver() { changed.addAll(); }

  ChangedBlocks changed;
  std::chrono::steady_clock::time_point next;  ///< earliest next publication

 protected:
  virtual void publishNew(const ServerSnapshot& snapshot) = 0;

  ros::Publisher publisher_;
};

/// What the constructor of a publisher needs.
struct PublisherContext {
  ros::NodeHandle& node;  ///< its callback queue is served by the thread of the publishers
  const ServerConfig& config;
  /// Lists all changes in the publishers' `changed`, and returns the state that has them.
  std::function<std::shared_ptr<const ServerSnapshot>()> snapshot;

  /// Advertises a topic with whole maps: a new subscriber makes `owner` publish again.
  template <typename Message>
  ros::Publisher advertiseWhole(const std::string& topic, MapPublisher& owner) const {
    return advertise<Message>(
        topic, [&owner](const ros::SingleSubscriberPublisher&) { owner.changed.addAll(); }, config.latch);
  }
  /// Advertises a topic with updates. `send(subscriber, snapshot)` sends the whole map only to a new
  /// subscriber. Pending changes are published first, so that this map and the last update are of the same
  /// state.
  template <typename Message, typename Send>
  ros::Publisher advertiseUpdates(const std::string& topic, MapPublisher& owner, Send&& send) const {
    const auto connected = [&owner, send, make = snapshot](const ros::SingleSubscriberPublisher& subscriber) {
      owner.tryTo([&] {
        const std::shared_ptr<const ServerSnapshot> now = make();
        if (!owner.changed.empty()) owner.publish(*now);
        send(subscriber, *now);
      });
    };
    return advertise<Message>(topic, connected, false);
  }
  /// Advertises updates of the maps on another topic of `owner`. A new subscriber makes `owner` publish its
  /// whole map again: who subscribes to updates only once it has a map, as costmap_2d does, has missed those
  /// in between.
  template <typename Message>
  ros::Publisher advertiseUpdatesOf(const std::string& topic, MapPublisher& owner) const {
    return advertise<Message>(
        topic, [&owner](const ros::SingleSubscriberPublisher&) { owner.changed.addAll(); }, false);
  }

 private:
  template <typename Message, typename Connected>
  ros::Publisher advertise(const std::string& topic, const Connected& connected, bool latch) const {
    return node.advertise<Message>(topic, 10, connected, ros::SubscriberStatusCallback(), ros::VoidConstPtr(),
                                   latch);
  }
};

/// The registry of publishers: one of each.
std::vector<std::unique_ptr<MapPublisher>> makePublishers(const PublisherContext& context);

}  // namespace bki_mapping::ros_interface
