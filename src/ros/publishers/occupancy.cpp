#include "ros/class_info.h"
#include "streamed_blocks.h"
#include "updates.h"

namespace bki_mapping::ros_interface {
namespace {

/// Fills in a whole map: a StreamedMap or a StreamedUpdate.
template <typename Message>
void fillMap(const ServerSnapshot& snapshot, Message& message) {
  for (const SemanticClass& c : snapshot.classes.classes()) message.classes.push_back(toMessage(c));
  message.blocks.map = &snapshot;
  message.blocks.blocks = sortedBlocks(snapshot.map);
  message.blocks.threads = snapshot.threadsFor(snapshot.map.size());
}

class Occupancy : public MapPublisher {
 public:
  explicit Occupancy(const PublisherContext& context) {
    publisher_ = context.advertiseWhole<StreamedMap>("occupancy", *this);
  }

 private:
  void publishNew(const ServerSnapshot& snapshot) override {
    StreamedMap message;
    message.header = snapshot.header;
    message.resolution = static_cast<float>(snapshot.map.geometry().resolution());
    fillMap(snapshot, message);
    publisher_.publish(message);
  }
};

class OccupancyUpdates : public UpdatePublisher<StreamedUpdate> {
 public:
  explicit OccupancyUpdates(const PublisherContext& context)
      : UpdatePublisher(context, "occupancy_updates") {}

 private:
  void fillWhole(const ServerSnapshot& snapshot, StreamedUpdate& message) const override {
    fillMap(snapshot, message);
  }
  void fillChanges(const ServerSnapshot& snapshot, StreamedUpdate& message) const override {
    const SemanticMap& map = snapshot.map;
    message.blocks.map = &snapshot;
    message.blocks.threads = snapshot.threadsFor(changed.blocks().size());
    message.blocks.blocks.reserve(changed.blocks().size());
    for (const GridIndex& index : changed.blocks()) {
      if (const Block* block = map.find({index})) {
        message.blocks.blocks.emplace_back(BlockIndex{index}, block);
      } else {
        message.removed.push_back(toMessage(index));
      }
    }
  }
};

}  // namespace

std::unique_ptr<MapPublisher> makeOccupancy(const PublisherContext& context) {
  return std::make_unique<Occupancy>(context);
}

std::unique_ptr<MapPublisher> makeOccupancyUpdates(const PublisherContext& context) {
  return std::make_unique<OccupancyUpdates>(context);
}

}  // namespace bki_mapping::ros_interface
