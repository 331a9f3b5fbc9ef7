/// @file The mapper as a ROS service: clouds and tf in, maps out. Node and nodelet are shells around it.
#pragma once

#include <bki_mapping/SaveMap.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <sensor_msgs/PointCloud2.h>
#include <std_srvs/Empty.h>
#include <std_srvs/Trigger.h>

#include <atomic>
#include <memory>
#include <thread>
#include <vector>

#include "ros/live_settings.h"
#include "ros/map_publishing.h"
#include "ros/mapping_diagnostics.h"
#include "ros/point_account.h"
#include "ros/pose_source.h"
#include "ros/scan_ledger.h"
#include "ros/scan_queue.h"
#include "ros/scan_reader.h"
#include "ros/sentence_throttle.h"
#include "ros/time_watch.h"

namespace bki_mapping::ros_shell {

/// Owns a mapper and one thread. Subscriptions, services and publishers run on that thread through a queue of
/// their own; the threads of a nodelet manager are never blocked.
class MappingServer {
 public:
  /// @param node resolves topics. @param private_node holds parameters and services.
  /// @throws std::invalid_argument if a parameter is unknown or not allowed.
  MappingServer(ros::NodeHandle node, ros::NodeHandle private_node);
  /// Stops the thread after the work in hand.
  ~MappingServer();

 private:
  using Clock = std::chrono::steady_clock;

  void subscribe();
  void applySettings(const ServerConfig& server, const MapperConfig& mapper);
  void offerServices();
  void work();

  using CloudEvent = ros::MessageEvent<const sensor_msgs::PointCloud2>;
  void onCloud(std::size_t input, const CloudEvent& event);
  bool onReset(std_srvs::Empty::Request&, std_srvs::Empty::Response&);
  bool onPublishMap(std_srvs::Empty::Request&, std_srvs::Empty::Response&);
  bool onPause(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response);
  bool onResume(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response);
  bool onSaveMap(SaveMap::Request& request, SaveMap::Response& response);

  /// Deals with the first waiting cloud whose transform is there or has been waited for long enough.
  void processQueue();
  void map(const WaitingCloud& waiting);
  void integrate(const WaitingCloud& waiting, const PlacedScan& placed);
  void reset();
  void checkClock();
  void onTimeJump(const ros::Time& new_time, const std::string& what);
  /// Says once of each input that points were left out since its range is not known.
  void warnOfFarPoints(std::size_t input, std::size_t count);
  void appendPose(const std_msgs::Header& header, const Eigen::Isometry3d& T_map_sensor);
  /// Forgets blocks and poses outside of the window about the sensor.
  void moveWindow();
  /// Counts a cloud as dropped and says so, but repeats no sentence within 5 s.
  void drop(const WaitingCloud& cloud, DropReason reason, const std::string& why);
  /// Judges the points since the last call, input by input, and says what is wrong with them.
  Health judgeAllPoints();
  MappingStatus status();
  MapSnapshot snapshot() const;

  ros::CallbackQueue queue_;
  ros::NodeHandle node_, private_node_;
  ServerConfig config_;
  std::unique_ptr<SemanticMapper> mapper_;
  std::vector<ScanReader> readers_;   ///< one an input
  std::vector<PointAccount> points_;  ///< of each input, since the last report
  ScanLedger ledger_;
  ScanQueue waiting_;
  TimeWatch time_watch_;
  bool paused_ = false;

  ros::Time map_stamp_;
  Eigen::Vector3d sensor_ = Eigen::Vector3d::Zero();  ///< origin of the last scan
  std::vector<geometry_msgs::PoseStamped> trajectory_;
  SentenceThrottle throttle_;
  std::vector<bool> warned_of_origin_, warned_of_far_points_;  ///< of each input

  std::unique_ptr<PoseSource> poses_;
  std::vector<ros::Subscriber> cloud_subscribers_;
  std::vector<ros::ServiceServer> services_;
  ros::Publisher status_publisher_;
  std::unique_ptr<MapPublishing> publishing_;
  std::unique_ptr<MappingDiagnostics> diagnostics_;
  std::unique_ptr<LiveSettings> live_settings_;

  std::atomic<bool> running_{true};
  std::thread thread_;
};

}  // namespace bki_mapping::ros_shell
