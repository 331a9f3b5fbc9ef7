#include <bki_mapping/OccupancyMap.h>
#include <bki_mapping/OccupancyUpdate.h>

#include <cstring>
#include <utility>
#include <vector>

#include "bki_mapping/rules/map_snapshot.h"
#include "bki_mapping/rules/voxel_state.h"
#include "ros/class_info.h"
#include "streamed_message.h"
#include "updates.h"

namespace bki_mapping::ros_interface {
namespace {

/// The field `blocks` of OccupancyMap and OccupancyUpdate. The map must outlive it, and not change.
struct OccupancyBlocks {
  std::uint32_t bytes() const { return messageBytes(blocks.size(), kBytes); }
  std::uint32_t count() const { return static_cast<std::uint32_t>(blocks.size()); }
  void write(std::uint8_t* to) const {
    constexpr std::size_t kBlocksPerJob = 64;
    ThreadPool pool(threads);
    pool.forEach((blocks.size() + kBlocksPerJob - 1) / kBlocksPerJob, [&](std::size_t job, std::size_t) {
      const std::size_t begin = job * kBlocksPerJob, end = std::min(blocks.size(), begin + kBlocksPerJob);
      for (std::size_t b = begin; b < end; ++b) write(blocks[b].first, *blocks[b].second, to + b * kBytes);
    });
  }

  const MapSnapshot* map = nullptr;
  std::vector<std::pair<BlockIndex, const Block*>> blocks;
  int threads = 1;  ///< that write

 private:
  static constexpr std::size_t kBytes = 3 * sizeof(std::int32_t) + 2 * kBlockVoxels +
                                        3 * sizeof(float) * kBlockVoxels;  ///< of an OccupancyBlock

  void write(const BlockIndex& index, const Block& block, std::uint8_t* to) const {
    BlockView view;
    readBlock(map->map, map->rules, index, block, BlockFields::kAllButEntropy, view);
    OccupancyBlock message;
    message.x = index.x;
    message.y = index.y;
    message.z = index.z;
    copy(view.state, message.state);
    copy(view.label, message.label);
    copy(view.probability, message.probability);
    copy(view.occupancy, message.occupancy);
    copy(view.class_probability, message.class_probability);
    ros::serialization::OStream stream(to, kBytes);
    stream.next(message);
  }
  template <typename From, typename To>
  static void copy(const From& from, To& to) {
    static_assert(sizeof(from) == sizeof(to));
    std::memcpy(to.data(), from.data(), sizeof(to));
  }
};

using StreamedBlocks = StreamedArray<OccupancyBlocks>;

struct OccupancyMapFields {
  using Message = OccupancyMap;

  template <typename Visit>
  void visitMembers(const Visit& visit) const {
    visit(header, resolution, block_edge, classes, blocks);
  }

  std_msgs::Header header;
  float resolution = 0.0f;
  std::uint32_t block_edge = kBlockEdge;
  std::vector<ClassInfo> classes;
  StreamedBlocks blocks;
};
using StreamedMap = StreamedMessage<OccupancyMapFields>;

struct OccupancyUpdateFields {
  using Message = OccupancyUpdate;

  template <typename Visit>
  void visitMembers(const Visit& visit) const {
    visit(header, sequence, whole, resolution, block_edge, classes, blocks, removed);
  }

  std_msgs::Header header;
  std::uint64_t sequence = 0;
  std::uint8_t whole = false;
  float resolution = 0.0f;
  std::uint32_t block_edge = kBlockEdge;
  std::vector<ClassInfo> classes;
  StreamedBlocks blocks;
  std::vector<BlockCoordinates> removed;
};
using StreamedUpdate = StreamedMessage<OccupancyUpdateFields>;

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
