/// @file The frame in which clouds of voxels are sent.
#pragma once

#include <tf2_ros/static_transform_broadcaster.h>

#include <Eigen/Core>
#include <optional>
#include <string>

namespace bki_mapping::ros_interface {

/// The map frame or, where float32 is too coarse for voxels because the origin of the map frame is too far
/// away, a child of it whose origin is near. Its name says where: `map_at_500000_4000000_0`, so that it is
/// the same frame for every mapper and in every recording. tf_static connects it with the map frame.
class CloudFrame {
 public:
  /// Moves the origin if float32 is too coarse between it and a place [m], map frame.
  void follow(const Eigen::Vector3d& place, double resolution, const std::string& map_frame);

  /// The name of the frame, for which the map frame is given.
  std::string name(const std::string& map_frame) const;
  /// In the map frame [m].
  const Eigen::Vector3d& origin() const { return origin_; }

 private:
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  std::optional<tf2_ros::StaticTransformBroadcaster> tf_;  ///< once it is needed
};

/// What to say of a sensor where float32 is too coarse for voxels, with the remedy; "" elsewhere.
/// @param place of the sensor, map frame [m].
std::string farFromOriginWarning(const Eigen::Vector3d& place, double resolution,
                                 const std::string& map_frame);

}  // namespace bki_mapping::ros_interface
