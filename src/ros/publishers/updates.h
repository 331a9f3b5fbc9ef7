/// @file Common parts of the topics with updates.
#pragma once

#include <bki_mapping/BlockCoordinates.h>

#include <cstdint>
#include <string>

#include "ros/map_publisher.h"

namespace bki_mapping::ros_interface {

inline BlockCoordinates toMessage(const GridIndex& block) {
  BlockCoordinates message;
  message.x = block.x;
  message.y = block.y;
  message.z = block.z;
  return message;
}

/// Publishes changed blocks, and the whole map to each new subscriber and on request. A sequence number lets
/// clients detect a missed update.
/// @tparam Message has header, sequence, whole and resolution.
template <typename Message>
class UpdatePublisher : public MapPublisher {
 protected:
  UpdatePublisher(const PublisherContext& context, const std::string& topic) {
    publisher_ = context.advertiseUpdates<Message>(
        topic, *this, [this](const auto& subscriber, const ServerSnapshot& snapshot) {
          subscriber.publish(message(snapshot, true));
        });
  }

 private:
  virtual void fillWhole(const ServerSnapshot& snapshot, Message& message) const = 0;
  /// Fills in the blocks in `changed`.
  virtual void fillChanges(const ServerSnapshot& snapshot, Message& message) const = 0;

  void publishNew(const ServerSnapshot& snapshot) override {
    ++sequence_;
    publisher_.publish(message(snapshot, changed.all()));
  }

  Message message(const ServerSnapshot& snapshot, bool whole) const {
    Message message;
    message.header = snapshot.header;
    message.sequence = sequence_;
    message.whole = whole;
    message.resolution = static_cast<float>(snapshot.map.geometry().resolution());
    whole ? fillWhole(snapshot, message) : fillChanges(snapshot, message);
    return message;
  }

  std::uint64_t sequence_ = 0;
};

}  // namespace bki_mapping::ros_interface
