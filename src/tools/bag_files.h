/// @file Bags that are read as one recording.
#pragma once

#include <rosbag/bag.h>
#include <rosbag/view.h>

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

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

}  // namespace bki_mapping::tools
