/// @file Reads the messages of bags into a mapper.
#pragma once

#include <ros/time.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "ros/recording_mapper.h"
#include "tools/interruption.h"

namespace bki_mapping::tools {

/// Some bags, whose messages come in the order of their recording, whatever bag they are in and in whatever
/// order the bags are named: as `rosbag play` plays them.
class BagFiles {
 public:
  /// Opens the bags. @throws std::runtime_error in one sentence with the remedy if one cannot be read.
  explicit BagFiles(std::vector<std::string> paths);

  std::size_t count() const { return bags_.size(); }
  /// "bag 'a.bag'", "bags 'a.bag', 'b.bag'".
  std::string text() const;
  /// The file names, joined by plus signs.
  std::string names() const;
  /// The topics with clouds, and the number of clouds of each.
  std::map<std::string, std::size_t> cloudTopics() const;
  /// The name in the bags of a topic with clouds, which may lack the slash at its beginning.
  /// @param option to name the topic, for the sentence.
  /// @throws std::invalid_argument if there is no such topic, with those that there are.
  std::string cloudTopic(const std::string& topic, const std::string& option) const;

  /// When each message of some topics was recorded, in this order.
  std::vector<ros::Time> times(const std::vector<std::string>& topics) const;

  /// Calls `use` with the messages of some topics recorded from `begin` to `end`, until it returns false.
  /// @throws std::runtime_error if a bag is damaged.
  void read(const std::vector<std::string>& topics, const ros::Time& begin, const ros::Time& end,
            const std::function<bool(const rosbag::MessageInstance&)>& use) const;

 private:
  std::vector<std::string> paths_;
  std::vector<std::unique_ptr<rosbag::Bag>> bags_;
};

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
