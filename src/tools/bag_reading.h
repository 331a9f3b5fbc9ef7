/// @file Reads the messages of bags into a mapper.
#pragma once

#include <ros/time.h>

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "ros/recording_mapper.h"
#include "tools/bag_files.h"
#include "tools/interruption.h"

namespace bki_mapping::tools {

/// Clouds by their number in the order of their recording: from `first` on, without `last`.
struct CloudRange {
  std::size_t first, last;
  std::size_t size() const { return last - first; }
};

/// The clouds of some topics, with the transforms that they need.
class BagReading {
 public:
  /// @param bags, recording must outlive this. @param topics of the recording's inputs, in their order.
  BagReading(const BagFiles& bags, std::vector<std::string> topics,
             ros_interface::RecordingMapper& recording);

  /// When each cloud was recorded.
  const std::vector<ros::Time>& times() const { return times_; }

  /// The range, cut where parts of a recording can be: clouds of several topics or bags that were recorded at
  /// one time have no order, so a part has all of them or none.
  CloudRange cuttable(const CloudRange& range) const;

  /// Maps a range of the clouds, or, after a signal, those that had been read by then.
  /// @param progress is told how many have been mapped or dropped, whenever that changes.
  /// @return the range that was read. @throws std::runtime_error if a bag is damaged.
  CloudRange map(const CloudRange& range, const Interruption& interruption,
                 const std::function<void(std::size_t)>& progress);

 private:
  /// Reads the static transforms recorded up to a time, which still hold then.
  void readStaticTransforms(const ros::Time& end);
  bool isCloud(const rosbag::MessageInstance& message) const;
  void addTransforms(const rosbag::MessageInstance& message);
  /// The number of the first cloud that was recorded at the same time as a cloud, if they have no order.
  std::size_t firstAtTimeOf(std::size_t cloud) const;
  /// @param mapped false: the cloud is before the range, and only its stamp is of use.
  void addCloud(const rosbag::MessageInstance& message, bool mapped);

  const BagFiles& bags_;
  std::vector<std::string> topics_;
  ros_interface::RecordingMapper& recording_;
  std::vector<ros::Time> times_;
};

}  // namespace bki_mapping::tools
