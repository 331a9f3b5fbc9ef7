#include <bki_mapping/OccupancyMap.h>
#include <bki_mapping/OccupancyUpdate.h>

#include "bki_mapping/map/map_query.h"
#include "updates.h"

namespace bki_mapping::ros_interface {
namespace {

OccupancyBlock toMessage(const SemanticMap& map, const BlockIndex& index, const Block& block) {
  OccupancyBlock message;
  message.x = index.x;
  message.y = index.y;
  message.z = index.z;
  for (int offset = 0; offset < kBlockVoxels; ++offset) {
    const VoxelView view = viewWithoutEntropy(map, block, offset);
    const auto v = static_cast<std::size_t>(offset);
    message.state[v] = static_cast<std::uint8_t>(view.state);
    message.label[v] = view.label;
    message.probability[v] = view.probability;
    message.occupancy[v] = view.occupancy;
    message.class_probability[v] = view.class_probability;
  }
  return message;
}

/// Fills in a whole map: an OccupancyMap or an OccupancyUpdate.
template <typename Message>
void fillMap(const MapSnapshot& snapshot, Message& message) {
  const SemanticMap& map = snapshot.map;
  message.block_edge = kBlockEdge;
  for (const SemanticClass& c : snapshot.classes.classes()) {
    ClassInfo info;
    info.id = c.id;
    info.name = c.name;
    info.red = c.color[0];
    info.green = c.color[1];
    info.blue = c.color[2];
    info.dynamic = c.dynamic;
    message.classes.push_back(info);
  }
  message.blocks.reserve(map.size());
  for (const auto& [index, block] : sortedBlocks(map))
    message.blocks.push_back(toMessage(map, index, *block));
}

class Occupancy : public MapPublisher {
 public:
  explicit Occupancy(const PublisherContext& context) {
    publisher_ = context.advertiseWhole<OccupancyMap>("occupancy", *this);
  }

 private:
  void publishNew(const MapSnapshot& snapshot) override {
    OccupancyMap message;
    message.header = snapshot.header;
    message.resolution = static_cast<float>(snapshot.map.geometry().resolution());
    fillMap(snapshot, message);
    publisher_.publish(message);
  }
};

class OccupancyUpdates : public UpdatePublisher<OccupancyUpdate> {
 public:
  explicit OccupancyUpdates(const PublisherContext& context)
      : UpdatePublisher(context, "occupancy_updates") {}

 private:
  void fillWhole(const MapSnapshot& snapshot, OccupancyUpdate& message) const override {
    fillMap(snapshot, message);
  }
  void fillChanges(const MapSnapshot& snapshot, OccupancyUpdate& message) const override {
    const SemanticMap& map = snapshot.map;
    message.block_edge = kBlockEdge;
    message.blocks.reserve(changed.blocks().size());
    for (const GridIndex& index : changed.blocks()) {
      if (const Block* block = map.find({index})) {
        message.blocks.push_back(toMessage(map, {index}, *block));
      } else {
        message.removed.push_back(ros_interface::toMessage(index));
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
