#include "bki_mapping/ros/mapping_server.h"

#include <algorithm>

#include "bki_mapping/io/class_table_yaml.h"
#include "bki_mapping/io/map_export.h"
#include "bki_mapping/ros/cloud_conversion.h"
#include "bki_mapping/ros/pose_conversion.h"

namespace bki_mapping::ros_shell {
namespace {

constexpr auto kSayAgainAfter = std::chrono::seconds(5);
/// How long the thread sleeps while nothing, or while a transform, is waited for [s].
constexpr double kIdleWait = 0.1, kTransformWait = 0.005;

}  // namespace

MappingServer::MappingServer(ros::NodeHandle node, ros::NodeHandle private_node)
    : node_(std::move(node)), private_node_(std::move(private_node)) {
  node_.setCallbackQueue(&queue_);
  private_node_.setCallbackQueue(&queue_);
  MapperConfig mapper_config;
  readParameters(private_node_, config_, mapper_config);
  mapper_ = std::make_unique<SemanticMapper>(
      mapper_config, std::make_shared<const ClassTable>(loadClassTable(config_.classes)));

  tf_listener_ = std::make_unique<tf2_ros::TransformListener>(tf_buffer_, node_);
  publishers_ = makePublishers({node_, config_, [this] { publish_due_ = true; }});
  status_publisher_ = private_node_.advertise<MappingStatus>("status", 10, true);
  reset_service_ = private_node_.advertiseService("reset", &MappingServer::onReset, this);
  save_service_ = private_node_.advertiseService("save_map", &MappingServer::onSaveMap, this);
  // No limit here: the queue that counts what it drops is waiting_, and it takes clouds over between scans.
  cloud_subscriber_ = node_.subscribe("cloud_in", 0, &MappingServer::onCloud, this);
  publishStatus(std_msgs::Header(), false);
  ROS_INFO("Mapping %s into frame '%s' with free_space/mode %s, %g m voxels",
           cloud_subscriber_.getTopic().c_str(), config_.frame_id.c_str(),
           mapper_config.free_space.mode.c_str(), mapper_config.resolution);
  thread_ = std::thread(&MappingServer::work, this);
}

MappingServer::~MappingServer() {
  running_ = false;
  thread_.join();
  ROS_INFO(
      "Mapped %lu of %lu clouds; dropped: %lu without a transform, %lu bad, %lu empty, %lu from the full "
      "queue",
      status_.integrated, status_.received, status_.dropped_no_transform, status_.dropped_bad_cloud,
      status_.dropped_empty, status_.dropped_queue_full);
}

void MappingServer::work() {
  while (running_) {
    queue_.callAvailable(ros::WallDuration(waiting_.empty() ? kIdleWait : kTransformWait));
    processQueue();
    publishMaps();
  }
}

void MappingServer::onCloud(const sensor_msgs::PointCloud2ConstPtr& cloud) {
  ++status_.received;
  waiting_.push_back({cloud, Clock::now()});
  if (waiting_.size() > static_cast<std::size_t>(config_.queue_size)) {
    const auto oldest = waiting_.front().cloud;
    waiting_.pop_front();
    drop(*oldest, DropReason::kQueueFull,
         "queue_size " + std::to_string(config_.queue_size) +
             " is reached: clouds come faster than they are mapped; use a faster free_space/mode, a coarser "
             "resolution or fewer clouds");
  }
}

void MappingServer::processQueue() {
  if (waiting_.empty()) return;
  const WaitingCloud& next = waiting_.front();
  const std_msgs::Header& header = next.cloud->header;
  std::string why;
  const bool found = tf_buffer_.canTransform(config_.frame_id, header.frame_id, header.stamp, &why);
  const std::chrono::duration<double> waited = Clock::now() - next.received;
  if (!found && waited.count() < config_.tf_timeout) return;
  const sensor_msgs::PointCloud2ConstPtr cloud = next.cloud;
  waiting_.pop_front();
  if (!found) {
    drop(*cloud, DropReason::kNoTransform,
         "no transform from '" + header.frame_id + "' to '" + config_.frame_id + "' came within tf_timeout " +
             numberText(config_.tf_timeout) + " s; publish that transform, or set frame_id or tf_timeout (" +
             why + ")");
    return;
  }
  integrate(*cloud, tf_buffer_.lookupTransform(config_.frame_id, header.frame_id, header.stamp));
}

void MappingServer::integrate(const sensor_msgs::PointCloud2& cloud,
                              const geometry_msgs::TransformStamped& pose) {
  if (cloud.width == 0 || cloud.height == 0) {
    drop(cloud, DropReason::kEmpty, "it has no points; check the sensor");
    return;
  }
  ScanStats stats;
  try {
    CloudContent content = readCloud(cloud, config_.label_field);
    const Scan scan = scanFromSensorFrame(toIsometry(pose.transform), content.points,
                                          std::move(content.labels), cloud.header.stamp.toNSec());
    stats = mapper_->integrate(scan);
  } catch (const std::invalid_argument& fault) {
    drop(cloud, DropReason::kBadCloud,
         std::string(fault.what()) + "; check the cloud's source and label_field");
    return;
  }
  ++status_.integrated;
  status_.points_dropped += stats.counts.points - stats.counts.used;
  status_.labels_not_in_table += stats.counts.labels_not_in_table;
  status_.integration_ms = static_cast<float>(stats.totalMs());
  map_stamp_ = cloud.header.stamp;
  geometry_msgs::PoseStamped sensor;
  sensor.header.frame_id = config_.frame_id;
  sensor.header.stamp = cloud.header.stamp;
  sensor.pose.position.x = pose.transform.translation.x;
  sensor.pose.position.y = pose.transform.translation.y;
  sensor.pose.position.z = pose.transform.translation.z;
  sensor.pose.orientation = pose.transform.rotation;
  trajectory_.push_back(sensor);
  publish_due_ = true;
  publishStatus(cloud.header, true);
}

void MappingServer::drop(const sensor_msgs::PointCloud2& cloud, DropReason reason, const std::string& why) {
  switch (reason) {
    case DropReason::kNoTransform:
      ++status_.dropped_no_transform;
      break;
    case DropReason::kBadCloud:
      ++status_.dropped_bad_cloud;
      break;
    case DropReason::kEmpty:
      ++status_.dropped_empty;
      break;
    case DropReason::kQueueFull:
      ++status_.dropped_queue_full;
      break;
  }
  const auto said = last_said_.find(reason);
  if (said == last_said_.end() || Clock::now() - said->second >= kSayAgainAfter) {
    last_said_[reason] = Clock::now();
    ROS_WARN("Dropped the cloud of time %.3f: %s", cloud.header.stamp.toSec(), why.c_str());
  }
  publishStatus(cloud.header, false);
}

void MappingServer::publishStatus(const std_msgs::Header& header, bool integrated) {
  status_.header = header;
  status_.integrated_last = integrated;
  status_.waiting = waiting_.size();
  status_.blocks = static_cast<std::uint32_t>(mapper_->map().size());
  status_.map_bytes = mapper_->map().bytes();
  status_publisher_.publish(status_);
}

void MappingServer::publishMaps() {
  const std::chrono::duration<double> since = Clock::now() - last_publish_;
  if (!publish_due_ || since.count() < 1.0 / config_.publish_rate) return;
  publish_due_ = false;
  MapSnapshot snapshot{std_msgs::Header(), *mapper_, trajectory_};
  snapshot.header.frame_id = config_.frame_id;
  snapshot.header.stamp = map_stamp_;
  for (const auto& publisher : publishers_) {
    if (publisher->wanted()) publisher->publish(snapshot);
  }
  last_publish_ = Clock::now();
}

bool MappingServer::onReset(std_srvs::Empty::Request&, std_srvs::Empty::Response&) {
  mapper_->reset();
  trajectory_.clear();
  publish_due_ = true;
  ROS_INFO("The map was reset");
  return true;
}

bool MappingServer::onSaveMap(SaveMap::Request& request, SaveMap::Response& response) {
  try {
    if (request.path.empty() || request.path.front() != '/') {
      throw std::invalid_argument("path '" + request.path + "' must be absolute");
    }
    const std::string include = request.include.empty() ? "occupied" : request.include;
    exportMap(request.path, mapper_->map(), mapper_->classes(), parseStates(include));
    response.success = true;
    response.message = "wrote " + request.path + " (" + include + ")";
  } catch (const std::exception& fault) {
    response.success = false;
    response.message = fault.what();
  }
  ROS_INFO("save_map: %s", response.message.c_str());
  return true;
}

}  // namespace bki_mapping::ros_shell
