#include <bki_mapping/OccupancyMap.h>
#include <bki_mapping/OccupancyUpdate.h>

#include "bki_mapping/core/map_query.h"
#include "bki_mapping/ros/map_publisher.h"

namespace bki_mapping::ros_shell {
namespace {

OccupancyBlock toMessage(const SemanticMap& map, const BlockIndex& index, const Block& block) {
  OccupancyBlock message;
  message.x = index.x;
  message.y = index.y;
  message.z = index.z;
  for (int offset = 0; offset < kBlockVoxels; ++offset) {
    const VoxelView view = judgeVoxel(map, block, offset);
    const auto v = static_cast<std::size_t>(offset);
    message.state[v] = static_cast<std::uint8_t>(view.state);
    message.label[v] = view.label;
    message.probability[v] = view.probability;
  }
  return message;
}

/// What a whole map has, be it an OccupancyMap or an OccupancyUpdate.
template <typename Message>
Message wholeMap(const MapSnapshot& snapshot) {
  const SemanticMap& map = snapshot.mapper.map();
  Message message;
  message.header = snapshot.header;
  message.resolution = static_cast<float>(map.geometry().resolution());
  message.block_edge = kBlockEdge;
  for (const SemanticClass& c : snapshot.mapper.classes().classes()) {
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
  return message;
}

class Occupancy : public MapPublisher {
 public:
  explicit Occupancy(const PublisherContext& context) {
    publisher_ = context.advertiseWhole<OccupancyMap>("occupancy", *this);
  }

 private:
  void publishNew(const MapSnapshot& snapshot) override {
    publisher_.publish(wholeMap<OccupancyMap>(snapshot));
  }
};

class OccupancyUpdates : public MapPublisher {
 public:
  explicit OccupancyUpdates(const PublisherContext& context) {
    publisher_ = context.advertiseUpdates<OccupancyUpdate>(
        "occupancy_updates", *this,
        [this](const auto& subscriber, const MapSnapshot& snapshot) { subscriber.publish(whole(snapshot)); });
  }

 private:
  void publishNew(const MapSnapshot& snapshot) override {
    ++sequence_;
    if (changed.all()) {
      publisher_.publish(whole(snapshot));
      return;
    }
    const SemanticMap& map = snapshot.mapper.map();
    OccupancyUpdate message;
    message.header = snapshot.header;
    message.sequence = sequence_;
    message.resolution = static_cast<float>(map.geometry().resolution());
    message.block_edge = kBlockEdge;
    message.blocks.reserve(changed.blocks().size());
    for (const GridIndex& index : changed.blocks()) {
      if (const Block* block = map.find({index})) {
        message.blocks.push_back(toMessage(map, {index}, *block));
      } else {
        message.removed.emplace_back();
        message.removed.back().x = index.x;
        message.removed.back().y = index.y;
        message.removed.back().z = index.z;
      }
    }
    publisher_.publish(message);
  }

  OccupancyUpdate whole(const MapSnapshot& snapshot) const {
    auto message = wholeMap<OccupancyUpdate>(snapshot);
    message.sequence = sequence_;
    message.whole = true;
    return message;
  }

  std::uint64_t sequence_ = 0;
};

}  // namespace

std::unique_ptr<MapPublisher> makeOccupancy(const PublisherContext& context) {
  return std::make_unique<Occupancy>(context);
}

std::unique_ptr<MapPublisher> makeOccupancyUpdates(const PublisherContext& context) {
  return std::make_unique<OccupancyUpdates>(context);
}

}  // namespace bki_mapping::ros_shell
