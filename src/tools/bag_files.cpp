#include "tools/bag_files.h"

#include <sensor_msgs/PointCloud2.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>
#include <stdexcept>

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

}  // namespace bki_mapping::tools
