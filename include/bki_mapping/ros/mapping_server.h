/// @file The mapper as a ROS service: clouds and tf in, maps out. Node and nodelet are shells around it.
#pragma once

#include <bki_mapping/MappingStatus.h>
#include <bki_mapping/SaveMap.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <sensor_msgs/PointCloud2.h>
#include <std_srvs/Empty.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>

#include <atomic>
#include <chrono>
#include <deque>
#include <map>
#include <memory>
#include <thread>
#include <vector>

#include "bki_mapping/ros/map_publisher.h"

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
  struct WaitingCloud {
    sensor_msgs::PointCloud2ConstPtr cloud;
    Clock::time_point received;
  };

  enum class DropReason { kNoTransform, kBadCloud, kEmpty, kQueueFull };

  void work();
  void onCloud(const sensor_msgs::PointCloud2ConstPtr& cloud);
  bool onReset(std_srvs::Empty::Request&, std_srvs::Empty::Response&);
  bool onSaveMap(SaveMap::Request& request, SaveMap::Response& response);

  /// Deals with the first waiting cloud if its transform is there or has been waited for long enough.
  void processQueue();
  void integrate(const sensor_msgs::PointCloud2& cloud, const geometry_msgs::TransformStamped& T_map_sensor);
  /// Counts a cloud as dropped and says so, at most once in 5 s for each reason.
  void drop(const sensor_msgs::PointCloud2& cloud, DropReason reason, const std::string& why);
  void publishStatus(const std_msgs::Header& header, bool integrated);
  void publishMaps();

  ros::CallbackQueue queue_;
  ros::NodeHandle node_, private_node_;
  ServerConfig config_;
  std::unique_ptr<SemanticMapper> mapper_;
  std::vector<geometry_msgs::PoseStamped> trajectory_;
  MappingStatus status_;
  ros::Time map_stamp_;

  std::deque<WaitingCloud> waiting_;
  std::map<DropReason, Clock::time_point> last_said_;  ///< by reason
  bool publish_due_ = false;
  Clock::time_point last_publish_;

  tf2_ros::Buffer tf_buffer_;
  std::unique_ptr<tf2_ros::TransformListener> tf_listener_;
  ros::Subscriber cloud_subscriber_;
  ros::ServiceServer reset_service_, save_service_;
  ros::Publisher status_publisher_;
  std::vector<std::unique_ptr<MapPublisher>> publishers_;

  std::atomic<bool> running_{true};
  std::thread thread_;
};

}  // namespace bki_mapping::ros_shell
