/// @file Arrays of cube markers as streamed messages.
#pragma once

#include <visualization_msgs/MarkerArray.h>

#include <cstring>
#include <functional>
#include <vector>

#include "streamed_message.h"

namespace bki_mapping::ros_interface {

/// A marker to which MarkerGroup::write adds the cubes.
struct StreamedMarker {
  visualization_msgs::Marker frame;  ///< all but points and colours
  std::size_t cubes = 0;

  std::uint32_t bytes() const {
    return messageBytes(ros::serialization::serializationLength(frame) + cubes * kBytes, 1);
  }

  static constexpr std::size_t kPointBytes = 3 * sizeof(double), kColorBytes = 4 * sizeof(float),
                               kBytes = kPointBytes + kColorBytes;  ///< of a cube
};

/// Writes the cubes of a marker, one after the other.
class CubeWriter {
 public:
  /// Writes all but the cubes.
  CubeWriter(const StreamedMarker& marker, ros::serialization::OStream& stream) {
    const visualization_msgs::Marker& frame = marker.frame;
    const auto cubes = static_cast<std::uint32_t>(marker.cubes);
    stream.next(frame.header);
    stream.next(frame.ns);
    stream.next(frame.id);
    stream.next(frame.type);
    stream.next(frame.action);
    stream.next(frame.pose);
    stream.next(frame.scale);
    stream.next(frame.color);
    stream.next(frame.lifetime);
    stream.next(frame.frame_locked);
    stream.next(cubes);
    point_ = stream.advance(messageBytes(cubes, StreamedMarker::kPointBytes));
    stream.next(cubes);
    color_ = stream.advance(messageBytes(cubes, StreamedMarker::kColorBytes));
    stream.next(frame.text);
    stream.next(frame.mesh_resource);
    stream.next(frame.mesh_use_embedded_materials);
  }

  void add(const double (&centre)[3], const std_msgs::ColorRGBA& color) {
    std::memcpy(point_, centre, StreamedMarker::kPointBytes);
    const float rgba[] = {color.r, color.g, color.b, color.a};
    std::memcpy(color_, rgba, StreamedMarker::kColorBytes);
    point_ += StreamedMarker::kPointBytes;
    color_ += StreamedMarker::kColorBytes;
  }

 private:
  std::uint8_t *point_, *color_;
};

/// Markers whose cubes are written together.
struct MarkerGroup {
  std::vector<StreamedMarker> markers;
  /// Adds to the writer of each marker as many cubes as the marker has. Called from any thread.
  std::function<void(std::vector<CubeWriter>&)> write;
};

/// The field `markers` of a MarkerArray.
struct MarkerGroups {
  std::uint32_t count() const {
    std::size_t markers = 0;
    for (const MarkerGroup& group : groups) markers += group.markers.size();
    return messageBytes(markers, 1);
  }
  std::uint32_t bytes() const { return messageBytes(begins().back(), 1); }
  void write(std::uint8_t* to) const {
    const std::vector<std::size_t> begin = begins();
    ThreadPool pool(threads);
    pool.forEachInOrder(groups.size(), [&](std::size_t g, std::size_t) {
      ros::serialization::OStream stream(to + begin[g], static_cast<std::uint32_t>(begin[g + 1] - begin[g]));
      std::vector<CubeWriter> writers;
      writers.reserve(groups[g].markers.size());
      for (const StreamedMarker& marker : groups[g].markers) writers.emplace_back(marker, stream);
      if (groups[g].write) groups[g].write(writers);
    });
  }

  std::vector<MarkerGroup> groups;
  int threads = 1;  ///< that write

 private:
  /// The first byte of each group; last, the number of all.
  std::vector<std::size_t> begins() const {
    std::vector<std::size_t> begins = {0};
    for (const MarkerGroup& group : groups) {
      std::size_t bytes = 0;
      for (const StreamedMarker& marker : group.markers) bytes += marker.bytes();
      begins.push_back(begins.back() + bytes);
    }
    return begins;
  }
};

struct MarkerArrayFields {
  using Message = visualization_msgs::MarkerArray;

  template <typename Visit>
  void visitMembers(const Visit& visit) const {
    visit(markers);
  }

  StreamedArray<MarkerGroups> markers;
};
using StreamedMarkers = StreamedMessage<MarkerArrayFields>;

}  // namespace bki_mapping::ros_interface
