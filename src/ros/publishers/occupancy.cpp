#include <bki_mapping/OccupancyMap.h>

#include "bki_mapping/core/map_query.h"
#include "bki_mapping/ros/map_publisher.h"

namespace bki_mapping::ros_shell {
namespace {

/// The whole map, block by block.
class Occupancy : public MapPublisher {
 public:
  explicit Occupancy(const PublisherContext& context) {
    publisher_ = context.advertise<OccupancyMap>("occupancy");
  }

  void publish(const MapSnapshot& snapshot) override {
    const SemanticMap& map = snapshot.mapper.map();
    OccupancyMap message;
    message.header = snapshot.header;
    message.resolution = static_cast<float>(map.geometry().resolution());
    message.block_edge = kBlockEdge;
    for (const SemanticClass& c : snapshot.mapper.classes().classes())
      message.classes.push_back(toMessage(c));
    for (const auto& [index, block] : sortedBlocks(map))
      message.blocks.push_back(toMessage(map, index, *block));
    publisher_.publish(message);
  }

 private:
  static ClassInfo toMessage(const SemanticClass& c) {
    ClassInfo info;
    info.id = c.id;
    info.name = c.name;
    info.red = c.color[0];
    info.green = c.color[1];
    info.blue = c.color[2];
    info.dynamic = c.dynamic;
    return info;
  }

  static OccupancyBlock toMessage(const SemanticMap& map, const BlockIndex& index, const Block& block) {
    OccupancyBlock message;
    message.x = index.x;
    message.y = index.y;
    message.z = index.z;
    for (int offset = 0; offset < kBlockVoxels; ++offset) {
      const VoxelView view = viewVoxel(map, block, offset);
      const auto v = static_cast<std::size_t>(offset);
      message.state[v] = static_cast<std::uint8_t>(view.state);
      message.label[v] = view.label;
      message.probability[v] = view.probability;
    }
    return message;
  }
};

}  // namespace

std::unique_ptr<MapPublisher> makeOccupancy(const PublisherContext& context) {
  return std::make_unique<Occupancy>(context);
}

}  // namespace bki_mapping::ros_shell
