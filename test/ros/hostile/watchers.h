/// @file What watches a mapper under attack: a watchdog, its log, its status, and the listeners of its
/// topics.
#pragma once

#include <bki_mapping/ElevationMap.h>
#include <bki_mapping/MappingStatus.h>
#include <bki_mapping/OccupancyMap.h>
#include <bki_mapping/OccupancyUpdate.h>
#include <bki_mapping/VoxelCloudUpdate.h>
#include <gtest/gtest.h>
#include <map_msgs/OccupancyGridUpdate.h>
#include <nav_msgs/OccupancyGrid.h>
#include <nav_msgs/Path.h>
#include <nodelet/loader.h>
#include <ros/ros.h>
#include <rosgraph_msgs/Log.h>
#include <sensor_msgs/PointCloud2.h>
#include <visualization_msgs/MarkerArray.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <thread>

#include "kinds.h"
#include "ros/point_account.h"
#include "ros/scan_ledger.h"
#include "settings.h"

namespace bki_mapping::hostile {

using Clock = std::chrono::steady_clock;

/// Maximum time for an answer [s].
constexpr double kLongestAnswer = 20.0;
/// Limits of the length of the message of a refusal, which a sender must not control [bytes].
constexpr std::size_t kShortestText = 20, kLongestText = 3000;

/// Name of the nodelet.
inline const std::string kName = "/hostile_mapping";

/// Ends the process when it hangs, because an exception cannot end a hang.
class Watchdog {
 public:
  Watchdog() : thread_([this] { watch(); }) {}
  ~Watchdog() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      over_ = true;
    }
    wake_.notify_all();
    thread_.join();
  }
  void feed(const std::string& doing) {
    const std::lock_guard<std::mutex> lock(mutex_);
    doing_ = doing;
    since_ = Clock::now();
  }

 private:
  void watch() {
    std::unique_lock<std::mutex> lock(mutex_);
    while (!wake_.wait_for(lock, std::chrono::seconds(1), [this] { return over_; })) {
      if (Clock::now() - since_ < std::chrono::duration<double>(6.0 * kLongestAnswer)) continue;
      std::printf("[hostile] hangs: %s\n", doing_.c_str());
      std::fflush(stdout);
      std::_Exit(3);
    }
  }

  std::mutex mutex_;
  std::condition_variable wake_;
  bool over_ = false;
  std::string doing_ = "start";
  Clock::time_point since_ = Clock::now();
  std::thread thread_;
};

/// Reads the log of this process: counts refusals of clouds, and checks the length of messages.
class LogReader {
 public:
  explicit LogReader(ros::NodeHandle& node) {
    subscriber_ = node.subscribe<rosgraph_msgs::Log>(
        "/rosout", 10000, [this](const rosgraph_msgs::Log::ConstPtr& m) { read(*m); });
  }
  std::size_t refusals() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return refusals_;
  }
  std::string longest() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return longest_;
  }
  std::size_t bytes() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return bytes_;
  }

 private:
  void read(const rosgraph_msgs::Log& log) {
    if (log.file.find("src/ros/") == std::string::npos) return;  // logged by a library
    const std::lock_guard<std::mutex> lock(mutex_);
    bytes_ += log.msg.size();
    if (log.msg.size() > longest_.size()) longest_ = log.msg;
    const std::string beginning = "Dropped the cloud of ";
    refusals_ +=
        log.level == rosgraph_msgs::Log::WARN && log.msg.compare(0, beginning.size(), beginning) == 0;
  }

  mutable std::mutex mutex_;
  std::size_t refusals_ = 0, bytes_ = 0;
  std::string longest_;
  ros::Subscriber subscriber_;
};

/// Loads and unloads the mapper, and checks the sums of its status.
class Mapper {
 public:
  explicit Mapper(ros::NodeHandle& node) : node_(node), loader_(true) {
    status_ = node.subscribe<MappingStatus>(kName + "/status", 10000,
                                            [this](const MappingStatus::ConstPtr& m) { onStatus(*m); });
  }
  ~Mapper() { unload(); }

  void load(const Settings& settings) {
    ros::param::del(kName);
    const std::map<std::string, std::string> common = {
        {"classes", "toy"},      {"tf_timeout", "0.02"}, {"publish_rate", "20"}, {"diagnostic_period", "0.2"},
        {"memory_limit", "100"}, {"window", "60"},       {"threads", "2"}};
    for (const auto& [name, value] : common) ros::param::set(kName + "/" + name, value);
    for (const auto& [name, value] : settings.values) ros::param::set(kName + "/" + name, value);
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      last_ = MappingStatus();
      fresh_ = false;
      reasons_.clear();
    }
    ASSERT_TRUE(loader_.load(kName, "bki_mapping/MappingNodelet", {{"/cloud_in", "/hostile_cloud"}}, {}));
    loaded_ = true;
    ASSERT_TRUE(waitFor([this] { return fresh_; })) << "no status after loading";
  }
  void unload() {
    if (loaded_) loader_.unload(kName);
    loaded_ = false;
  }

  /// Waits for a status with `received` clouds, none of them waiting. @return whether it arrived in time.
  bool settle(std::uint64_t received, MappingStatus& status) {
    const bool came = waitFor([&] { return last_.received == received && last_.waiting == 0; });
    const std::lock_guard<std::mutex> lock(mutex_);
    status = last_;
    return came;
  }

  /// Waits for a status with this number of messages of corrected_path. @return whether it arrived in time.
  bool settlePaths(std::uint64_t paths, MappingStatus& status) {
    const bool came = waitFor([&] { return last_.corrections + last_.corrections_refused == paths; });
    const std::lock_guard<std::mutex> lock(mutex_);
    status = last_;
    return came;
  }

  std::size_t faults() const { return faults_; }
  std::size_t statuses() const { return statuses_; }
  /// The reasons for which this mapper has dropped clouds.
  std::size_t reasons() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return reasons_.size();
  }

  template <typename Service>
  bool call(const std::string& name, Service& service) {
    // Again, because under load a call was once seen to end without the answer that the node had logged.
    return ros::service::call(kName + "/" + name, service) || ros::service::call(kName + "/" + name, service);
  }

 private:
  bool waitFor(const std::function<bool()>& condition) {
    std::unique_lock<std::mutex> lock(mutex_);
    return came_.wait_for(lock, std::chrono::duration<double>(kLongestAnswer), condition);
  }

  void onStatus(const MappingStatus& status) {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++statuses_;
    std::uint64_t dropped = 0;
    for (const ros_interface::DropKind& kind : ros_interface::dropKinds()) {
      dropped += status.*kind.count;
      if (status.*kind.count > 0) reasons_.insert(kind.reason);
    }
    if (status.received != status.integrated + status.waiting + dropped) {
      ++faults_;
      ADD_FAILURE() << "the books do not add up: " << status;
    }
    std::uint64_t points = status.points_used + status.points_no_returns;
    for (const ros_interface::PointKind& kind : ros_interface::pointKinds()) points += status.*kind.in_status;
    if (status.points_received != points) {
      ++faults_;
      ADD_FAILURE() << "points are lost: " << status;
    }
    const bool refused = !status.integrated_last && status.integrated + dropped > 0;
    if (refused && (status.last_drop.size() < kShortestText || status.last_drop.size() > kLongestText)) {
      ++faults_;
      ADD_FAILURE() << "this is no sentence: " << status.last_drop.substr(0, 300);
    }
    if (status.last_refusal.size() > kLongestText) {
      ++faults_;
      ADD_FAILURE() << "this is too long: " << status.last_refusal.substr(0, 300);
    }
    last_ = status;
    fresh_ = true;
    came_.notify_all();
  }

  ros::NodeHandle& node_;
  nodelet::Loader loader_;
  bool loaded_ = false;
  mutable std::mutex mutex_;
  std::condition_variable came_;
  MappingStatus last_;
  bool fresh_ = false;
  std::set<ros_interface::DropReason> reasons_;
  std::atomic<std::size_t> faults_{0}, statuses_{0};
  ros::Subscriber status_;
};

/// Subscribers of all topics that come and go at random.
class Listeners {
 public:
  explicit Listeners(ros::NodeHandle& node) : node_(node) {}

  void change(Dice& dice) {
    toggle<visualization_msgs::MarkerArray>(dice, "occupied_cells_vis_array");
    toggle<visualization_msgs::MarkerArray>(dice, "free_cells_vis_array");
    toggle<sensor_msgs::PointCloud2>(dice, "voxel_cloud");
    toggle<VoxelCloudUpdate>(dice, "voxel_cloud_updates");
    toggle<nav_msgs::OccupancyGrid>(dice, "projected_map");
    toggle<map_msgs::OccupancyGridUpdate>(dice, "projected_map_updates");
    toggle<ElevationMap>(dice, "elevation_map");
    toggle<OccupancyMap>(dice, "occupancy");
    toggle<OccupancyUpdate>(dice, "occupancy_updates");
    toggle<nav_msgs::Path>(dice, "trajectory");
    toggle<nav_msgs::OccupancyGrid>(dice, "distance_section");
  }
  void leave() { subscribers_.clear(); }
  std::size_t received() const { return received_; }

 private:
  template <typename Message>
  void toggle(Dice& dice, const std::string& topic) {
    if (dice.oneIn(2)) return;
    if (subscribers_.erase(topic) > 0) return;
    subscribers_[topic] =
        node_.subscribe<Message>(topic, 2, [this](const typename Message::ConstPtr&) { ++received_; });
  }

  ros::NodeHandle& node_;
  std::map<std::string, ros::Subscriber> subscribers_;
  std::atomic<std::size_t> received_{0};
};

}  // namespace bki_mapping::hostile
