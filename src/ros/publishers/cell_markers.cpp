#include <visualization_msgs/MarkerArray.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "bki_mapping/map/map_query.h"
#include "map/voxel_color.h"
#include "ros/map_publisher.h"

namespace bki_mapping::ros_interface {
namespace {

std_msgs::ColorRGBA rgba(const Color& color, float alpha) {
  std_msgs::ColorRGBA c;
  c.r = static_cast<float>(color[0]) / 255.0f;
  c.g = static_cast<float>(color[1]) / 255.0f;
  c.b = static_cast<float>(color[2]) / 255.0f;
  c.a = alpha;
  return c;
}

/// A rainbow from blue through green to red for values from 0 to 1.
Color rainbow(double value) {
  const double v = std::clamp(value, 0.0, 1.0);
  const auto channel = [&](double peak) {
    return static_cast<std::uint8_t>(255.0 * std::clamp(1.5 - std::abs(4.0 * v - peak), 0.0, 1.0));
  };
  return {channel(3.0), channel(2.0), channel(1.0)};
}

/// Position in the colour scale of heights, which repeats every 20 m.
double heightFraction(double z) {
  return z / 20.0 - std::floor(z / 20.0);
}

Color colorOf(const VoxelView& view, double z, ColorMode mode, const ClassTable& classes) {
  switch (mode) {
    case ColorMode::kProbability:
      return rainbow(view.probability);
    case ColorMode::kVariance:
      return rainbow(4.0 * view.variance);  // p (1 - p) is at most 1/4
    case ColorMode::kHeight:
      return rainbow(heightFraction(z));
    default:
      return semanticColor(view, classes);
  }
}

constexpr int kRegionEdge = SemanticMap::kRegionEdge;

/// Marker arrays with one CUBE_LIST per class and region of the map: its namespace is the class's name, its
/// id that of the region. Only changed regions are sent; a marker that became empty is deleted.
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
    regions_.clear();
    free_ids_.clear();
  }

 private:
  using Markers = std::map<ClassId, Marker>;

  /// A region in which the map holds at least one block.
  struct Region {
    std::int32_t id;
    bool in_view = false;
    std::set<ClassId> shown;  ///< classes whose markers the subscribers hold
  };
  using Regions = std::map<GridIndex, Region>;

  void publishNew(const MapSnapshot& snapshot) override {
    if (changed.all()) {
      publisher_.publish(whole(snapshot));
      return;
    }
    IndexNumbering regions;
    for (const GridIndex& block : changed.blocks()) regions.insert(SemanticMap::regionOf({block}));
    for (const auto& [index, region] : regions_) {  // the view moves with the sensor
      if (inView(index, snapshot) != region.in_view) regions.insert(index);
    }
    MarkerArray message;
    for (const GridIndex& index : regions.members()) appendRegion(regionAt(index), snapshot, message);
    forgetEmpty(regions.members(), snapshot);
    if (!message.markers.empty()) publisher_.publish(message);
  }

  MarkerArray whole(const MapSnapshot& snapshot) {
    MarkerArray message;
    message.markers.emplace_back();
    message.markers.back().header = snapshot.header;
    message.markers.back().action = Marker::DELETEALL;
    message.markers.back().pose.orientation.w = 1.0;
    for (const auto& entry : snapshot.map.entries()) regionAt(SemanticMap::regionOf(entry.index));
    std::vector<GridIndex> indices;
    for (auto region = regions_.begin(); region != regions_.end(); ++region) {
      region->second.shown.clear();
      appendRegion(region, snapshot, message);
      indices.push_back(region->first);
    }
    forgetEmpty(indices, snapshot);
    return message;
  }

  /// Finds a region, or creates it with an id that none of the subscribers' markers has.
  Regions::iterator regionAt(const GridIndex& index) {
    const auto known = regions_.find(index);
    if (known != regions_.end()) return known;
    auto id = static_cast<std::int32_t>(regions_.size());  // without free ids, 0 to size - 1 are in use
    if (!free_ids_.empty()) {
      id = free_ids_.back();
      free_ids_.pop_back();
    }
    return regions_.emplace(index, Region{id, false, {}}).first;
  }

  /// Forgets regions without a block and frees their ids. To be called after the message is complete: it
  /// still deletes the markers with these ids, so that only the next message may use them again.
  void forgetEmpty(const std::vector<GridIndex>& indices, const MapSnapshot& snapshot) {
    for (const GridIndex& index : indices) {
      bool any = false;
      for (int n = 0; n < kRegionEdge * kRegionEdge * kRegionEdge && !any; ++n) {
        any = snapshot.map.find({GridGeometry::voxelOf({index}, n)});
      }
      if (any) continue;
      free_ids_.push_back(regions_.at(index).id);
      regions_.erase(index);
    }
  }

  bool inView(const GridIndex& region, const MapSnapshot& snapshot) const {
    const double edge = kRegionEdge * snapshot.map.geometry().blockSize();
    return snapshot.inView(Eigen::Vector3d(region.x + 0.5, region.y + 0.5, region.z + 0.5) * edge, edge);
  }

  void appendRegion(Regions::iterator entry, const MapSnapshot& snapshot, MarkerArray& message) {
    Region& region = entry->second;
    Markers markers;
    region.in_view = inView(entry->first, snapshot);
    if (region.in_view) fill(entry->first, snapshot, markers);
    const std::set<ClassId> before = std::move(region.shown);
    region.shown.clear();
    for (const ClassId gone : before) {
      if (markers.count(gone) > 0) continue;
      message.markers.push_back(emptyMarker(snapshot, gone));
      message.markers.back().action = Marker::DELETE;
      message.markers.back().id = region.id;
    }
    for (auto& [label, marker] : markers) {
      marker.id = region.id;
      region.shown.insert(label);
      message.markers.push_back(std::move(marker));
    }
  }

  void fill(const GridIndex& region, const MapSnapshot& snapshot, Markers& markers) const {
    const SemanticMap& map = snapshot.map;
    for (int n = 0; n < kRegionEdge * kRegionEdge * kRegionEdge; ++n) {
      const BlockIndex index{GridGeometry::voxelOf({region}, n)};
      const Block* block = map.find(index);
      for (int offset = 0; block && offset < kBlockVoxels; ++offset) {
        const VoxelView view = viewWithoutEntropy(map, *block, offset);
        if (view.state != state_) continue;
        const Eigen::Vector3d centre = map.geometry().voxelCentre(GridGeometry::voxelOf(index, offset));
        if (!snapshot.heightInView(centre.z())) continue;
        auto marker = markers.find(view.label);
        if (marker == markers.end()) {
          marker = markers.emplace(view.label, emptyMarker(snapshot, view.label)).first;
        }
        geometry_msgs::Point point;
        point.x = centre.x();
        point.y = centre.y();
        point.z = centre.z();
        marker->second.points.push_back(point);
        marker->second.colors.push_back(
            rgba(colorOf(view, centre.z(), snapshot.config.color_mode, snapshot.classes), alpha_));
      }
    }
  }

  Marker emptyMarker(const MapSnapshot& snapshot, ClassId label) const {
    const SemanticClass* known = snapshot.classes.find(label);
    Marker marker;
    marker.header = snapshot.header;
    marker.ns = known ? known->name : "free";
    marker.type = Marker::CUBE_LIST;
    marker.action = Marker::ADD;
    marker.pose.orientation.w = 1.0;
    const double edge = snapshot.map.geometry().resolution();
    marker.scale.x = marker.scale.y = marker.scale.z = edge;
    marker.color.a = alpha_;
    return marker;
  }

  VoxelState state_;
  float alpha_;
  Regions regions_;                     ///< whose markers the subscribers hold
  std::vector<std::int32_t> free_ids_;  ///< smaller than the largest id in use
};

}  // namespace

std::unique_ptr<MapPublisher> makeOccupiedCells(const PublisherContext& context) {
  return std::make_unique<CellMarkers>(context, "occupied_cells_vis_array", VoxelState::kOccupied, 1.0f);
}

std::unique_ptr<MapPublisher> makeFreeCells(const PublisherContext& context) {
  return std::make_unique<CellMarkers>(context, "free_cells_vis_array", VoxelState::kFree, 0.1f);
}

}  // namespace bki_mapping::ros_interface
