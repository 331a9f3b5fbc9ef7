/// @file The server behind node and nodelet: takes clouds and tf, and publishes the map.
#pragma once

#include <bki_mapping/BoundingBoxQuery.h>
#include <bki_mapping/LoadMap.h>
#include <bki_mapping/SaveMap.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <sensor_msgs/PointCloud2.h>
#include <std_srvs/Empty.h>
#include <std_srvs/Trigger.h>

#include <atomic>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "ros/corrected_poses.h"
#include "ros/input_notes.h"
#include "ros/kept_map.h"
#include "ros/live_settings.h"
#include "ros/mapping_diagnostics.h"
#include "ros/point_account.h"
#include "ros/pose_source.h"
#include "ros/publisher_set.h"
#include "ros/query_services.h"
#include "ros/scan_ledger.h"
#include "ros/scan_queue.h"
#include "ros/scan_reader.h"
#include "ros/sensor_trajectory.h"
#include "ros/sentence_throttle.h"
#include "ros/time_watch.h"

namespace bki_mapping::ros_interface {

/// Owns a mapper and threads, each with a callback queue of its own, so that mapping never blocks the
/// threads of a nodelet manager. The mapping thread takes clouds and adds them to the map; only this thread
/// uses the mapper. One more thread publishes the map topics, one serves ~save_map and ~load_map, and
/// QueryServices has threads for queries. All of them work on snapshots, which the mapping thread makes
/// between two scans.
class MappingServer {
 public:
  /// @param node resolves topics. @param private_node holds parameters and services.
  /// @throws std::invalid_argument if a parameter is unknown or not allowed.
  MappingServer(ros::NodeHandle node, ros::NodeHandle private_node);
  /// Finishes the current scan and stops the threads.
  ~MappingServer();

 private:
  using Clock = std::chrono::steady_clock;

  void subscribe();
  void applySettings(const ServerConfig& server, const MapperConfig& mapper);
  void offerServices();
  ScanReader readerOf(const InputConfig& input) const;
  void work();

  using CloudEvent = ros::MessageEvent<const sensor_msgs::PointCloud2>;
  void onCloud(std::size_t input, const CloudEvent& event);
  bool onReset(std_srvs::Empty::Request&, std_srvs::Empty::Response&);
  bool onPublishMap(std_srvs::Empty::Request&, std_srvs::Empty::Response&);
  bool onPause(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response);
  bool onResume(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response);
  bool onForgetJournal(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response);
  bool onClearBox(BoundingBoxQuery::Request& request, BoundingBoxQuery::Response&);
  bool onSaveMap(SaveMap::Request& request, SaveMap::Response& response);
  bool onLoadMap(LoadMap::Request& request, LoadMap::Response& response);

  /// Handles messages, so that every cloud is in waiting_ and counted.
  void handleMessages();
  /// Maps or refuses the first waiting cloud whose transform is available, or whose tf_timeout is over.
  /// @return whether there was one.
  bool processQueue();
  /// Whether there is time for what no cloud should wait for. @param has_mapped whether a cloud has just been
  /// dealt with.
  bool hasTime(bool has_mapped);
  void map(const WaitingCloud& waiting);
  void integrate(const WaitingCloud& waiting, const PlacedScan& placed);
  void reset();
  void checkClock();
  /// Counts the jumps of tf, and says how large they are.
  void reportTfJumps();
  void onTimeJump(const ros::Time& new_time, const std::string& what);
  /// Logs what is worth saying of an input after one of its clouds.
  void sayOfInput(const WaitingCloud& waiting, const PlacedScan& placed, const PointCounts& counts);
  /// Warns once that the sensor is too far from the origin for programs that calculate in float32.
  void warnOfFarPlace();
  /// Logs what is wrong with the map file, when that changes.
  void reportFault();
  /// Adds a scan, also where memory must first be gained for it.
  ScanStats addToMap(const Scan& scan);
  /// Adds the scan of a cloud, and keeps it if there is a journal.
  ScanStats addToMap(const WaitingCloud& waiting, const PlacedScan& placed);
  /// Counts a cloud as dropped and logs the reason, each sentence at most once in 5 s.
  void drop(const WaitingCloud& cloud, DropReason reason, const std::string& why);
  /// Assesses the points of each input since the last call, and logs warnings.
  Health judgeAllPoints();
  MappingStatus status();
  /// Reports a change of the map to publishers and queries: of some blocks, or of all that is known of it.
  void mapChanged(const std::vector<GridIndex>& blocks);
  void wholeMapChanged();
  /// The map frame, and the stamp of the last scan.
  std_msgs::Header mapHeader() const;
  /// The state of the server. For the mapping thread.
  ServerSnapshot snapshot();
  /// The same for all other threads: waits until the mapping thread has no scan in work.
  std::shared_ptr<const ServerSnapshot> askForSnapshot();
  /// Writes the whole map to a map file. @throws MapFileError.
  void saveMapFile(const std::string& path);

  ros::CallbackQueue queue_, saving_queue_;
  ros::NodeHandle node_, private_node_;
  ServerConfig config_;
  std::unique_ptr<SemanticMapper> mapper_;
  std::unique_ptr<KeptMap> kept_;
  std::string last_fault_;            ///< of the map file, as logged
  std::vector<ScanReader> readers_;   ///< one per input
  std::vector<PointAccount> points_;  ///< of each input, since the last report
  ScanLedger ledger_;
  ScanQueue waiting_;
  TimeWatch time_watch_;
  bool paused_ = false;

  Clock::time_point had_time_;  ///< when there was time after a cloud
  ros::Time map_stamp_;
  Eigen::Vector3d sensor_ = Eigen::Vector3d::Zero();  ///< origin of the last scan
  SensorTrajectory trajectory_;
  SentenceThrottle throttle_;
  std::vector<InputNotes> notes_;  ///< of each input
  bool warned_of_far_place_ = false;

  std::unique_ptr<PoseSource> poses_;
  std::unique_ptr<CorrectedPoses> corrected_;  ///< nullptr without a journal
  Scan rounded_;  ///< the last scan, as the journal keeps it; its memory is used again
  std::vector<ros::Subscriber> cloud_subscribers_;
  std::vector<ros::ServiceServer> services_;
  ros::Publisher status_publisher_;
  std::unique_ptr<PublisherSet> publishing_;
  std::unique_ptr<QueryServices> queries_;
  std::unique_ptr<MappingDiagnostics> diagnostics_;
  std::unique_ptr<LiveSettings> live_settings_;

  ros::AsyncSpinner saving_{1, &saving_queue_};
  std::atomic<bool> running_{true};
  std::thread thread_;
};

}  // namespace bki_mapping::ros_interface
