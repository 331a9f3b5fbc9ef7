#include <visualization_msgs/MarkerArray.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "bki_mapping/core/map_query.h"
#include "bki_mapping/core/voxel_color.h"
#include "bki_mapping/ros/map_publisher.h"

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

/// One CUBE_LIST a class, in a namespace with the class's name.
class CellMarkers : public MapPublisher {
 public:
  CellMarkers(const PublisherContext& context, const std::string& topic, VoxelState state, ColorMode mode,
              float alpha)
      : state_(state), mode_(mode), alpha_(alpha) {
    publisher_ = context.advertise<visualization_msgs::MarkerArray>(topic);
  }

  void publish(const MapSnapshot& snapshot) override {
    const SemanticMapper& mapper = snapshot.mapper;
    std::map<ClassId, visualization_msgs::Marker> markers;
    for (const SemanticClass& c : mapper.classes().classes()) {
      if (state_ == VoxelState::kOccupied) markers[c.id] = emptyMarker(snapshot, c.name);
    }
    if (state_ == VoxelState::kFree) markers[kFreeClass] = emptyMarker(snapshot, "free");
    forEachKnownVoxel(mapper.map(), [&](const VoxelIndex& voxel, const VoxelView& view) {
      if (view.state != state_) return;
      const Eigen::Vector3d centre = mapper.map().geometry().voxelCentre(voxel);
      visualization_msgs::Marker& marker = markers.at(view.label);
      geometry_msgs::Point point;
      point.x = centre.x();
      point.y = centre.y();
      point.z = centre.z();
      marker.points.push_back(point);
      marker.colors.push_back(rgba(colorOf(view, centre.z(), mode_, mapper.classes()), alpha_));
    });
    visualization_msgs::MarkerArray message;
    for (auto& [id, marker] : markers) {
      if (marker.points.empty()) marker.action = visualization_msgs::Marker::DELETE;
      message.markers.push_back(std::move(marker));
    }
    publisher_.publish(message);
  }

 private:
  visualization_msgs::Marker emptyMarker(const MapSnapshot& snapshot, const std::string& name) const {
    visualization_msgs::Marker marker;
    marker.header = snapshot.header;
    marker.ns = name;
    marker.type = visualization_msgs::Marker::CUBE_LIST;
    marker.action = visualization_msgs::Marker::ADD;
    marker.pose.orientation.w = 1.0;
    const double edge = snapshot.mapper.map().geometry().resolution();
    marker.scale.x = marker.scale.y = marker.scale.z = edge;
    marker.color.a = alpha_;
    return marker;
  }

  VoxelState state_;
  ColorMode mode_;
  float alpha_;
};

}  // namespace

std::unique_ptr<MapPublisher> makeOccupiedCells(const PublisherContext& context) {
  return std::make_unique<CellMarkers>(context, "occupied_cells_vis_array", VoxelState::kOccupied,
                                       context.config.color_mode, 1.0f);
}

std::unique_ptr<MapPublisher> makeFreeCells(const PublisherContext& context) {
  return std::make_unique<CellMarkers>(context, "free_cells_vis_array", VoxelState::kFree,
                                       context.config.color_mode, 0.1f);
}

}  // namespace bki_mapping::ros_shell
