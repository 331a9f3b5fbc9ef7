#include "tools/bag_reading.h"

#include <sensor_msgs/PointCloud2.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>
#include <stdexcept>
#include <utility>

#include "tools/options.h"

namespace bki_mapping::tools {
namespace {

/// @throws std::runtime_error if a file is not there, or no bag.
void checkIsBag(const std::string& path) {
  constexpr char kBeginning[] = "#ROSBAG V";
  char beginning[sizeof kBeginning - 1] = {};
  std::error_code ignored;
  const bool folder = std::filesystem::is_directory(path, ignored);
  std::ifstream file(path, std::ios::binary);
  if (folder || !file) {
    throw std::runtime_error("bag '" + path + "' cannot be read (" + std::strerror(folder ? EISDIR : errno) +
                             "); name a bag");
  }
  file.read(beginning, sizeof beginning);
  if (!file || !std::equal(std::begin(beginning), std::end(beginning), kBeginning)) {
    throw std::runtime_error("'" + path + "' is no bag; name one");
  }
}

std::unique_ptr<rosbag::Bag> openBag(const std::string& path) {
  checkIsBag(path);
  const std::string remedy = "; run: rosbag reindex '" + path + "'";
  try {
    return std::make_unique<rosbag::Bag>(path, rosbag::bagmode::Read);
  } catch (const rosbag::BagUnindexedException&) {
    throw std::runtime_error("bag '" + path + "' has no index because its recording was interrupted" +
                             remedy);
  } catch (const std::exception& fault) {  // also std::bad_alloc and others where bytes are wrong
    throw std::runtime_error("bag '" + path + "' is cut short or damaged (" + fault.what() + ")" + remedy);
  }
}

template <typename Strings>
std::string joined(const Strings& strings, const std::string& between) {
  std::string text;
  for (const std::string& each : strings) text += (text.empty() ? "" : between) + each;
  return text;
}

bool isStatic(const std::string& topic) {
  return topic == "/tf_static" || topic == "tf_static";  // as it was recorded
}

/// Transforms are read from so long before the first cloud on: longer than tf keeps them, and than clouds
/// wait [s].
constexpr double kTfBefore = 2.0 * ros_interface::RecordingMapper::kLongestWait;

}  // namespace

BagFiles::BagFiles(std::vector<std::string> paths) : paths_(std::move(paths)) {
  std::set<std::string> seen;
  for (const std::string& path : paths_) {
    bags_.push_back(openBag(path));
    if (!seen.insert(std::filesystem::canonical(path).string()).second) {
      throw std::invalid_argument("bag '" + path + "' is named twice; its clouds would count twice");
    }
  }
}

std::string BagFiles::text() const {
  return (paths_.size() == 1 ? "bag '" : "bags '") + joined(paths_, "', '") + "'";
}

std::string BagFiles::names() const {
  std::vector<std::string> names;
  for (const std::string& path : paths_) names.push_back(std::filesystem::path(path).filename().string());
  return joined(names, "+");
}

std::map<std::string, std::size_t> BagFiles::cloudTopics() const {
  std::map<std::string, std::size_t> topics;
  for (const auto& bag : bags_) {
    rosbag::View clouds(*bag, rosbag::TypeQuery(ros::message_traits::datatype<sensor_msgs::PointCloud2>()));
    for (const rosbag::MessageInstance& message : clouds) ++topics[message.getTopic()];
  }
  return topics;
}

std::string BagFiles::cloudTopic(const std::string& topic, const std::string& option) const {
  const std::map<std::string, std::size_t> topics = cloudTopics();
  for (const std::string& name : {topic, "/" + topic}) {
    if (topics.count(name) > 0) return name;
  }
  const std::string have = text() + (bags_.size() == 1 ? " has " : " have ");
  if (topics.empty()) throw std::invalid_argument(have + "no clouds (sensor_msgs/PointCloud2); record some");
  std::vector<std::string> names;
  for (const auto& each : topics) names.push_back(each.first);
  throw std::invalid_argument(have + "no clouds on " + topic + "; there are some on: " + joined(names, ", ") +
                              "; choose with " + option);
}

std::vector<ros::Time> BagFiles::times(const std::vector<std::string>& topics) const {
  std::vector<ros::Time> times;
  read(topics, ros::TIME_MIN, ros::TIME_MAX, [&](const rosbag::MessageInstance& message) {
    times.push_back(message.getTime());
    return true;
  });
  return times;
}

void BagFiles::read(const std::vector<std::string>& topics, const ros::Time& begin, const ros::Time& end,
                    const std::function<bool(const rosbag::MessageInstance&)>& use) const {
  rosbag::View view;
  for (const auto& bag : bags_) view.addQuery(*bag, rosbag::TopicQuery(topics), begin, end);
  try {
    for (const rosbag::MessageInstance& message : view) {
      if (!use(message)) return;
    }
  } catch (const rosbag::BagException& fault) {
    throw std::runtime_error(text() + (bags_.size() == 1 ? " is" : " are") + " damaged (" + fault.what() +
                             "); run: rosbag reindex FILE");
  }
}

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
