#include <visualization_msgs/MarkerArray.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "bki_mapping/map/map_query.h"
#include "map/voxel_color.h"
#include "ros/map_publisher.h"

namespace bki_mapping::ros_shell {
namespace {

std_msgs::ColorRGBA rgba(const Color& color, float alpha) {
  std_msgs::ColorRGBA c;
  c.r = static_cast<float>(color[0]) / 255.0f;
  c.g = static_cast<float>(color[1]) / 255.0f;
  c.b = static_cast<float>(color[2]) / 255.0f;
  c.a = alpha;
  return c;
}

/// Blue over green to red for values from 0 to 1.
Color rainbow(double value) {
  const double v = std::clamp(value, 0.0, 1.0);
  const auto channel = [&](double peak) {
    return static_cast<std::uint8_t>(255.0 * std::clamp(1.5 - std::abs(4.0 * v - peak), 0.0, 1.0));
  };
  return {channel(3.0), channel(2.0), channel(1.0)};
}

/// Heights repeat their colours every 20 m.
double heightShare(double z) {
  return z / 20.0 - std::floor(z / 20.0);
}

Color colorOf(const VoxelView& view, double z, ColorMode mode, const ClassTable& classes) {
  switch (mode) {
    case ColorMode::kProbability:
      return rainbow(view.probability);
    case ColorMode::kVariance:
      return rainbow(4.0 * view.variance);  // p (1 - p) is at most 1/4
    case ColorMode::kHeight:
      return rainbow(heightShare(z));
    default:
      return semanticColor(view, classes);
  }
}

/// A chunk is a cube of this many blocks a side.
constexpr int kChunkEdge = 8;

GridIndex chunkOf(const GridIndex& block) {
  static_assert(kChunkEdge == kBlockEdge, "blocks lie in a chunk as voxels lie in a block");
  return GridGeometry::blockOf({block});
}

/// Marker arrays in which each marker is the CUBE_LIST of one class in one chunk: namespace the class's name,
/// id the chunk's number. Only chunks that changed are sent; a marker that became empty is deleted.
class CellMarkers : public MapPublisher {
 public:
  using MarkerArray = visualization_msgs::MarkerArray;
  using Marker = visualization_msgs::Marker;

  CellMarkers(const PublisherContext& context, const std::string& topic, VoxelState state, float alpha)
      : state_(state), alpha_(alpha) {
    publisher_ = context.advertiseUpdates<MarkerArray>(
        topic, *this,
        [this](const auto& subscriber, const MapSnapshot& snapshot) { subscriber.publish(whole(snapshot)); });
  }

  void rest() override {
    MapPublisher::rest();
    chunks_.clear();
    free_ids_.clear();
  }

 private:
  using Markers = std::map<ClassId, Marker>;

  /// A chunk of which the map holds a block.
  struct Chunk {
    std::int32_t id;
    bool in_view = false;
    std::set<ClassId> shown;  ///< the classes of which listeners hold a marker
  };
  using Chunks = std::map<GridIndex, Chunk>;

  void publishNew(const MapSnapshot& snapshot) override {
    if (changed.all()) {
      publisher_.publish(whole(snapshot));
      return;
    }
    IndexNumbering chunks;
    for (const GridIndex& block : changed.blocks()) chunks.insert(chunkOf(block));
    for (const auto& [index, chunk] : chunks_) {  // the sensor's view moves on
      if (inView(index, snapshot) != chunk.in_view) chunks.insert(index);
    }
    MarkerArray message;
    for (const GridIndex& index : chunks.members()) appendChunk(chunkAt(index), snapshot, message);
    forgetEmpty(chunks.members(), snapshot);
    if (!message.markers.empty()) publisher_.publish(message);
  }

  MarkerArray whole(const MapSnapshot& snapshot) {
    MarkerArray message;
    message.markers.emplace_back();
    message.markers.back().header = snapshot.header;
    message.markers.back().action = Marker::DELETEALL;
    message.markers.back().pose.orientation.w = 1.0;
    for (const auto& entry : snapshot.mapper.map().entries()) chunkAt(chunkOf(entry.index));
    std::vector<GridIndex> indices;
    for (auto place = chunks_.begin(); place != chunks_.end(); ++place) {
      place->second.shown.clear();
      appendChunk(place, snapshot, message);
      indices.push_back(place->first);
    }
    forgetEmpty(indices, snapshot);
    return message;
  }

  /// Finds a chunk, or makes it with an id that no marker of listeners has.
  Chunks::iterator chunkAt(const GridIndex& index) {
    const auto place = chunks_.find(index);
    if (place != chunks_.end()) return place;
    auto id = static_cast<std::int32_t>(chunks_.size());  // as many are in use where none is free
    if (!free_ids_.empty()) {
      id = free_ids_.back();
      free_ids_.pop_back();
    }
    return chunks_.emplace(index, Chunk{id, false, {}}).first;
  }

  /// Forgets chunks without a block. Called last, since their ids are free only for the next message: this
  /// one deletes their markers.
  void forgetEmpty(const std::vector<GridIndex>& indices, const MapSnapshot& snapshot) {
    for (const GridIndex& index : indices) {
      bool any = false;
      for (int n = 0; n < kChunkEdge * kChunkEdge * kChunkEdge && !any; ++n) {
        any = snapshot.mapper.map().find({GridGeometry::voxelOf({index}, n)});
      }
      if (any) continue;
      free_ids_.push_back(chunks_.at(index).id);
      chunks_.erase(index);
    }
  }

  bool inView(const GridIndex& chunk, const MapSnapshot& snapshot) const {
    const double edge = kChunkEdge * snapshot.mapper.map().geometry().blockSize();
    return snapshot.inView(Eigen::Vector3d(chunk.x + 0.5, chunk.y + 0.5, chunk.z + 0.5) * edge, edge);
  }

  void appendChunk(Chunks::iterator place, const MapSnapshot& snapshot, MarkerArray& message) {
    Chunk& chunk = place->second;
    Markers markers;
    chunk.in_view = inView(place->first, snapshot);
    if (chunk.in_view) fill(place->first, snapshot, markers);
    const std::set<ClassId> before = std::move(chunk.shown);
    chunk.shown.clear();
    for (const ClassId gone : before) {
      if (markers.count(gone) > 0) continue;
      message.markers.push_back(emptyMarker(snapshot, gone));
      message.markers.back().action = Marker::DELETE;
      message.markers.back().id = chunk.id;
    }
    for (auto& [label, marker] : markers) {
      marker.id = chunk.id;
      chunk.shown.insert(label);
      message.markers.push_back(std::move(marker));
    }
  }

  void fill(const GridIndex& chunk, const MapSnapshot& snapshot, Markers& markers) const {
    const SemanticMap& map = snapshot.mapper.map();
    for (int n = 0; n < kChunkEdge * kChunkEdge * kChunkEdge; ++n) {
      const BlockIndex index{GridGeometry::voxelOf({chunk}, n)};
      const Block* block = map.find(index);
      for (int offset = 0; block && offset < kBlockVoxels; ++offset) {
        const VoxelView view = judgeVoxel(map, *block, offset);
        if (view.state != state_) continue;
        const Eigen::Vector3d centre = map.geometry().voxelCentre(GridGeometry::voxelOf(index, offset));
        if (!snapshot.heightInView(centre.z())) continue;
        auto place = markers.find(view.label);
        if (place == markers.end()) {
          place = markers.emplace(view.label, emptyMarker(snapshot, view.label)).first;
        }
        geometry_msgs::Point point;
        point.x = centre.x();
        point.y = centre.y();
        point.z = centre.z();
        place->second.points.push_back(point);
        place->second.colors.push_back(
            rgba(colorOf(view, centre.z(), snapshot.config.color_mode, snapshot.mapper.classes()), alpha_));
      }
    }
  }

  Marker emptyMarker(const MapSnapshot& snapshot, ClassId label) const {
    const SemanticClass* known = snapshot.mapper.classes().find(label);
    Marker marker;
    marker.header = snapshot.header;
    marker.ns = known ? known->name : "free";
    marker.type = Marker::CUBE_LIST;
    marker.action = Marker::ADD;
    marker.pose.orientation.w = 1.0;
    const double edge = snapshot.mapper.map().geometry().resolution();
    marker.scale.x = marker.scale.y = marker.scale.z = edge;
    marker.color.a = alpha_;
    return marker;
  }

  VoxelState state_;
  float alpha_;
  Chunks chunks_;                       ///< what listeners hold
  std::vector<std::int32_t> free_ids_;  ///< below the greatest in use, and of no chunk
};

}  // namespace

std::unique_ptr<MapPublisher> makeOccupiedCells(const PublisherContext& context) {
  return std::make_unique<CellMarkers>(context, "occupied_cells_vis_array", VoxelState::kOccupied, 1.0f);
}

std::unique_ptr<MapPublisher> makeFreeCells(const PublisherContext& context) {
  return std::make_unique<CellMarkers>(context, "free_cells_vis_array", VoxelState::kFree, 0.1f);
}

}  // namespace bki_mapping::ros_shell
