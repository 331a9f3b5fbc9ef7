/// @file Maps a recording: its transforms and clouds in the order in which they were recorded.
#pragma once

#include <tf2_msgs/TFMessage.h>

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/store/map_file.h"
#include "journal/kept_scans.h"
#include "ros/input_notes.h"
#include "ros/map_cloud.h"
#include "ros/odometry_poses.h"
#include "ros/point_account.h"
#include "ros/pose_source.h"
#include "ros/scan_ledger.h"
#include "ros/scan_queue.h"
#include "ros/sentence_throttle.h"
#include "ros/server_config.h"

namespace bki_mapping::ros_interface {

/// Does with the messages of a recording what MappingServer does with those that it receives, but clouds wait
/// for their transforms by the time of the recording, and never for the mapper. So the map is that of a node
/// that is sent the recording so slowly that it drops nothing.
class RecordingMapper {
 public:
  /// What to do with what there is to say, and with the statistics of each cloud that was mapped.
  struct Listener {
    std::function<void(const std::string&)> warn, inform;
    std::function<void(const PlacedScan&, const ScanStats&)> mapped;
    std::function<void()> forgotten;  ///< the map was reset, so it has none of the clouds before
  };

  /// How long a cloud waits for its transform [s of the recording]: as long as tf keeps transforms.
  static constexpr double kLongestWait = 10.0;

  /// @param mapper must outlive this. @param inputs with the topics as sentences name them.
  /// @param kept the scans of the mapper, if they are to be kept; must outlive this.
  RecordingMapper(SemanticMapper& mapper, const ServerConfig& config, const std::vector<InputConfig>& inputs,
                  Listener listener, KeptScans* kept = nullptr);

  // All messages are added in the order of their recording.
  void addTransforms(const tf2_msgs::TFMessage& message, bool is_static);
  /// @param recorded the time of its recording.
  void addCloud(std::size_t input, const sensor_msgs::PointCloud2ConstPtr& cloud, const ros::Time& recorded);
  /// Takes note of a cloud that is not to be mapped, because it tells whether time jumps.
  void passCloud(std::size_t input, const ros::Time& stamp);
  /// Counts a cloud that cannot be read as a bad one.
  void refuseCloud(std::size_t input, const std::string& why);

  /// Maps the clouds whose transforms have come, and drops those that have waited too long.
  /// @param recorded the time of the recording up to which messages have been added.
  void advance(const ros::Time& recorded);
  /// Maps or drops what still waits, since the recording is over, and warns of points that were of no use.
  void finish();

  std::size_t waiting() const { return waiting_.size(); }
  ScanLedger& ledger() { return ledger_; }
  /// What a map file says of the scans that are in the map, without id and name.
  const DriveRecord& drive() const { return drive_; }
  /// Of each reason for which clouds were dropped, why the first one was.
  const std::map<DropReason, std::string>& drops() const { return drops_; }

 private:
  void map(const WaitingCloud& waiting);
  void integrate(const WaitingCloud& waiting, const PlacedScan& placed);
  ScanStats addToMap(const PlacedScan& placed, const std::string& sensor_frame);
  void drop(std::size_t input, const std_msgs::Header& header, DropReason reason, const std::string& why);
  void onTimeJump(const ros::Time& new_time);
  void warnOnce(const std::string& sentence);

  SemanticMapper& mapper_;
  KeptScans* kept_;
  std::string frame_;
  OnTimeJump on_time_jump_;
  Listener listener_;
  PoseSource poses_;
  OdometryPoses odometry_;
  std::vector<ScanReader> readers_;  ///< one per input
  std::vector<InputNotes> notes_;    ///< of each input
  std::vector<PointAccount> points_;
  ScanLedger ledger_;
  ScanQueue waiting_;  ///< WaitingCloud::received is the time of the recording
  TimeWatch time_watch_;
  DriveRecord drive_;
  std::map<DropReason, std::string> drops_;
  SentenceThrottle throttle_;
};

}  // namespace bki_mapping::ros_interface
