/// @file Clouds of voxels as streamed messages.
#pragma once

#include <bki_mapping/VoxelCloudUpdate.h>
#include <pcl_conversions/pcl_conversions.h>
#include <sensor_msgs/PointCloud2.h>

#include <memory>
#include <utility>
#include <vector>

#include "io/voxel_pcl.h"
#include "io/voxel_points.h"
#include "streamed_message.h"

namespace bki_mapping::ros_interface {

/// The field `data` of a PointCloud2 of voxels. The map and the class table must outlive it, and not change.
class StreamedPoints {
 public:
  StreamedPoints() = default;  ///< no points
  /// Counts the points.
  StreamedPoints(const SemanticMap& map, const ClassTable& classes, const VoxelSelection& selection,
                 VoxelPoints::Blocks blocks)
      : content_(std::make_shared<Content>(map, classes, selection, std::move(blocks))) {}

  std::size_t points() const { return content_ ? content_->points.count() : 0; }
  std::uint32_t bytes() const { return messageBytes(points(), sizeof(VoxelPoint)); }
  std::uint32_t count() const { return bytes(); }  ///< elements of the array `data`
  void write(std::uint8_t* to) const {
    if (content_) content_->points.write(reinterpret_cast<VoxelPoint*>(to));
  }

 private:
  struct Content {
    Content(const SemanticMap& map, const ClassTable& classes, const VoxelSelection& selection,
            VoxelPoints::Blocks blocks)
        : pool(publishingThreads(blocks.size())), points(map, classes, selection, std::move(blocks), pool) {}

    ThreadPool pool;
    VoxelPoints points;
  };

  std::shared_ptr<const Content> content_;
};

/// A sensor_msgs/PointCloud2 of voxels.
struct StreamedCloud {
  StreamedCloud() = default;
  StreamedCloud(const std_msgs::Header& header, StreamedPoints points) : data(std::move(points)) {
    pcl_conversions::fromPCL(pclHeader(data.points()), frame);
    frame.header = header;
  }

  template <typename Visit>
  void forEachMember(const Visit& visit) const {
    visit(frame.header);
    visit(frame.height);
    visit(frame.width);
    visit(frame.fields);
    visit(frame.is_bigendian);
    visit(frame.point_step);
    visit(frame.row_step);
    visit(data);
    visit(frame.is_dense);
  }

  sensor_msgs::PointCloud2 frame;  ///< all but the data
  StreamedPoints data;
};

/// A bki_mapping/VoxelCloudUpdate.
struct StreamedCloudUpdate {
  template <typename Visit>
  void forEachMember(const Visit& visit) const {
    visit(header);
    visit(sequence);
    visit(whole);
    visit(resolution);
    visit(blocks);
    visit(cloud);
  }

  std_msgs::Header header;
  std::uint64_t sequence = 0;
  std::uint8_t whole = false;
  float resolution = 0.0f;
  std::vector<BlockCoordinates> blocks;
  StreamedCloud cloud;
};

}  // namespace bki_mapping::ros_interface

namespace ros {
namespace message_traits {

template <>
struct MD5Sum<bki_mapping::ros_interface::StreamedCloud>
    : bki_mapping::ros_interface::SameTrait<MD5Sum<sensor_msgs::PointCloud2>> {};
template <>
struct DataType<bki_mapping::ros_interface::StreamedCloud>
    : bki_mapping::ros_interface::SameTrait<DataType<sensor_msgs::PointCloud2>> {};
template <>
struct Definition<bki_mapping::ros_interface::StreamedCloud>
    : bki_mapping::ros_interface::SameTrait<Definition<sensor_msgs::PointCloud2>> {};

template <>
struct MD5Sum<bki_mapping::ros_interface::StreamedCloudUpdate>
    : bki_mapping::ros_interface::SameTrait<MD5Sum<bki_mapping::VoxelCloudUpdate>> {};
template <>
struct DataType<bki_mapping::ros_interface::StreamedCloudUpdate>
    : bki_mapping::ros_interface::SameTrait<DataType<bki_mapping::VoxelCloudUpdate>> {};
template <>
struct Definition<bki_mapping::ros_interface::StreamedCloudUpdate>
    : bki_mapping::ros_interface::SameTrait<Definition<bki_mapping::VoxelCloudUpdate>> {};

}  // namespace message_traits

namespace serialization {

template <>
struct Serializer<bki_mapping::ros_interface::StreamedPoints>
    : bki_mapping::ros_interface::ArraySerializer<bki_mapping::ros_interface::StreamedPoints> {};
template <>
struct Serializer<bki_mapping::ros_interface::StreamedCloud>
    : bki_mapping::ros_interface::MemberSerializer<bki_mapping::ros_interface::StreamedCloud> {};
template <>
struct Serializer<bki_mapping::ros_interface::StreamedCloudUpdate>
    : bki_mapping::ros_interface::MemberSerializer<bki_mapping::ros_interface::StreamedCloudUpdate> {};

}  // namespace serialization
}  // namespace ros
