#include "tools/bag_reading.h"

#include <sensor_msgs/PointCloud2.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <utility>

#include "tools/options.h"

namespace bki_mapping::tools {
namespace {

bool isStatic(const std::string& topic) {
  return topic == "/tf_static" || topic == "tf_static";  // as it was recorded
}

/// Transforms are read from so long before the first cloud on: longer than tf keeps them, and than clouds
/// wait [s].
constexpr double kTfBefore = 2.0 * ros_interface::RecordingMapper::kLongestWait;

}  // namespace

BagReading::BagReading(const BagFiles& bags, std::vector<std::string> topics,
                       ros_interface::RecordingMapper& recording)
    : bags_(bags), topics_(std::move(topics)), recording_(recording), times_(bags.times(topics_)) {}

std::size_t BagReading::firstAtTimeOf(std::size_t cloud) const {
  if (cloud >= times_.size() || (topics_.size() == 1 && bags_.count() == 1)) return cloud;
  const auto first = std::lower_bound(times_.begin(), times_.end(), times_[cloud]);
  return static_cast<std::size_t>(first - times_.begin());
}

CloudRange BagReading::cuttable(const CloudRange& range) const {
  return {firstAtTimeOf(range.first), firstAtTimeOf(range.last)};
}

CloudRange BagReading::map(const CloudRange& range, const Interruption& interruption,
                           const std::function<void(std::size_t)>& progress) {
  const ros::Time& first = times_[range.first];
  const ros::Time begin = first.toSec() > kTfBefore ? first - ros::Duration(kTfBefore) : ros::TIME_MIN;
  readStaticTransforms(begin);
  auto number =
      static_cast<std::size_t>(std::lower_bound(times_.begin(), times_.end(), begin) - times_.begin());
  CloudRange read = range;
  std::size_t told = 0;
  const auto tell = [&](std::size_t done) {
    if (done != told) progress(done);
    told = done;
  };
  std::vector<std::string> topics = topics_;
  topics.insert(topics.end(), {"/tf", "tf", "/tf_static", "tf_static"});
  bags_.read(topics, begin, ros::TIME_MAX, [&](const rosbag::MessageInstance& message) {
    // Where the next cloud has an order, reading may end before it.
    if (interruption.requested() && firstAtTimeOf(number) == number) {
      read.last = std::min(read.last, std::max(number, range.first));
    }
    if (!isCloud(message)) {
      addTransforms(message);
    } else {
      if (number < read.last) addCloud(message, number >= range.first);
      ++number;
    }
    recording_.advance(message.getTime());
    if (number > range.first) tell(std::min(number, read.last) - range.first - recording_.waiting());
    // Clouds that wait are still mapped, with the transforms that follow.
    return number < read.last || recording_.waiting() > 0;
  });
  recording_.finish();
  tell(read.size());
  return read;
}

void BagReading::readStaticTransforms(const ros::Time& end) {
  bags_.read({"/tf_static", "tf_static"}, ros::TIME_MIN, end, [&](const rosbag::MessageInstance& message) {
    addTransforms(message);
    return true;
  });
}

bool BagReading::isCloud(const rosbag::MessageInstance& message) const {
  return std::find(topics_.begin(), topics_.end(), message.getTopic()) != topics_.end();
}

void BagReading::addTransforms(const rosbag::MessageInstance& message) {
  try {
    const auto transforms = message.instantiate<tf2_msgs::TFMessage>();
    if (transforms) recording_.addTransforms(*transforms, isStatic(message.getTopic()));
  } catch (const rosbag::BagException&) {
    throw;
  } catch (const std::exception& fault) {
    warn("a message of " + message.getTopic() + " cannot be read, and is left out (" + fault.what() + ")");
  }
}

void BagReading::addCloud(const rosbag::MessageInstance& message, bool mapped) {
  for (std::size_t input = 0; input < topics_.size(); ++input) {
    if (topics_[input] != message.getTopic()) continue;
    try {
      const auto cloud = message.instantiate<sensor_msgs::PointCloud2>();
      if (cloud && mapped) {
        recording_.addCloud(input, cloud, message.getTime());
      } else if (cloud) {
        recording_.passCloud(input, cloud->header.stamp);
      } else if (mapped) {
        recording_.refuseCloud(input, "it is no sensor_msgs/PointCloud2, but a " + message.getDataType());
      }
    } catch (const rosbag::BagException&) {
      throw;
    } catch (const std::exception& fault) {
      if (!mapped) continue;
      recording_.refuseCloud(
          input, "its message cannot be read (" + std::string(fault.what()) + "); record it again");
    }
  }
}

}  // namespace bki_mapping::tools
