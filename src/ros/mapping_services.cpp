// The services of the mapping server.
#include "bki_mapping/io/map_export.h"
#include "ros/mapping_server.h"

namespace bki_mapping::ros_interface {
namespace {

/// Maximum length of an answer, which contains a path given by the client [bytes].
constexpr std::size_t kLongestAnswer = 1000;

}  // namespace

void MappingServer::offerServices() {
  services_.push_back(private_node_.advertiseService("reset", &MappingServer::onReset, this));
  services_.push_back(private_node_.advertiseService("publish_map", &MappingServer::onPublishMap, this));
  services_.push_back(private_node_.advertiseService("pause", &MappingServer::onPause, this));
  services_.push_back(private_node_.advertiseService("resume", &MappingServer::onResume, this));
  ros::NodeHandle saving(private_node_);
  saving.setCallbackQueue(&saving_queue_);
  services_.push_back(saving.advertiseService("save_map", &MappingServer::onSaveMap, this));
}

void MappingServer::reset() {
  mapper_->reset();
  trajectory_.clear();
  publishing_->startOver();
  ROS_INFO("The map was reset");
}

bool MappingServer::onReset(std_srvs::Empty::Request&, std_srvs::Empty::Response&) {
  reset();
  return true;
}

bool MappingServer::onPublishMap(std_srvs::Empty::Request&, std_srvs::Empty::Response&) {
  publishing_->startOver();
  return true;
}

bool MappingServer::onPause(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
  response.success = true;
  response.message = paused_ ? "mapping was paused already" : "mapping is paused; clouds are dropped";
  paused_ = true;
  status_publisher_.publish(status());
  ROS_INFO("%s", response.message.c_str());
  return true;
}

bool MappingServer::onResume(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
  response.success = true;
  response.message = paused_ ? "mapping goes on" : "mapping was not paused";
  paused_ = false;
  status_publisher_.publish(status());
  ROS_INFO("%s", response.message.c_str());
  return true;
}

bool MappingServer::onSaveMap(SaveMap::Request& request, SaveMap::Response& response) {
  try {
    if (request.path.empty() || request.path.front() != '/') {
      throw std::invalid_argument("path '" + request.path + "' must be absolute");
    }
    if (request.path.find('\0') != std::string::npos) {  // the file system would cut the path there
      throw std::invalid_argument("path '" + request.path + "' must not hold a zero byte");
    }
    const std::string include = request.include.empty() ? "occupied" : request.include;
    const VoxelStates states = parseStates(include);
    const std::shared_ptr<const MapSnapshot> snapshot = askForSnapshot();
    exportMap(request.path, snapshot->map, snapshot->classes, states);
    response.success = true;
    response.message = "wrote " + request.path + " (" + include + ")";
  } catch (const std::exception& fault) {
    response.success = false;
    response.message = fault.what();
  }
  response.message = shortText(response.message, kLongestAnswer);
  ROS_INFO("save_map: %s", response.message.c_str());
  return true;
}

}  // namespace bki_mapping::ros_interface
