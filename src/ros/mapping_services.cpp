// The services of the mapping server.
#include <chrono>

#include "bki_mapping/city/tiled_map.h"
#include "bki_mapping/export/map_export.h"
#include "bki_mapping/store/mapper_file.h"
#include "core/counted.h"
#include "ros/mapping_server.h"
#include "ros/queued_call.h"
#include "ros/service_answer.h"

namespace bki_mapping::ros_interface {
namespace {

/// Interval at which a service that waits for the map file checks whether the file can be written.
constexpr std::chrono::milliseconds kFaultPoll(200);

/// @throws std::invalid_argument if a file of a client cannot have this path.
void checkPath(const std::string& path) {
  if (path.empty() || path.front() != '/') {
    throw std::invalid_argument("path '" + path + "' must be absolute");
  }
  if (path.find('\0') != std::string::npos) {  // the file system would cut the path there
    throw std::invalid_argument("path '" + path + "' must not hold a zero byte");
  }
}

/// @throws std::invalid_argument if a file to be written lies in a city.
void refuseCity(const std::string& path) {
  const std::string city = cityAround(path);
  if (city.empty()) return;
  throw std::invalid_argument("path '" + path + "' is in the city " + city +
                              ", which only map_city may change; save the map elsewhere");
}

}  // namespace

void MappingServer::offerServices() {
  services_.push_back(private_node_.advertiseService("reset", &MappingServer::onReset, this));
  services_.push_back(private_node_.advertiseService("publish_map", &MappingServer::onPublishMap, this));
  services_.push_back(private_node_.advertiseService("pause", &MappingServer::onPause, this));
  services_.push_back(private_node_.advertiseService("resume", &MappingServer::onResume, this));
  services_.push_back(private_node_.advertiseService("clear_bbx", &MappingServer::onClearBox, this));
  services_.push_back(
      private_node_.advertiseService("forget_journal", &MappingServer::onForgetJournal, this));
  ros::NodeHandle saving(private_node_);
  saving.setCallbackQueue(&saving_queue_);
  services_.push_back(saving.advertiseService("save_map", &MappingServer::onSaveMap, this));
  services_.push_back(saving.advertiseService("load_map", &MappingServer::onLoadMap, this));
}

void MappingServer::reset() {
  if (kept_->readOnly()) {
    ROS_WARN("The map is not reset: it is read only (parameter read_only)");
    return;
  }
  kept_->reset();
  if (corrected_) corrected_->reset();
  trajectory_.clear();
  wholeMapChanged();
  status_publisher_.publish(status());
  ROS_INFO("The map was reset");
}

bool MappingServer::onReset(std_srvs::Empty::Request&, std_srvs::Empty::Response&) {
  reset();
  return !kept_->readOnly();
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

bool MappingServer::onForgetJournal(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
  try {
    response.message = counted(kept_->forgetJournal(), "scan") + " forgotten, which stay where they are";
    response.success = true;
    corrected_->reset();
    status_publisher_.publish(status());
    ROS_INFO("forget_journal: %s", response.message.c_str());
  } catch (const std::exception& fault) {
    response.success = false;
    response.message = fault.what();
  }
  return true;
}

bool MappingServer::onClearBox(BoundingBoxQuery::Request& request, BoundingBoxQuery::Response&) {
  const Eigen::Vector3d a(request.min.x, request.min.y, request.min.z),
      b(request.max.x, request.max.y, request.max.z);
  try {
    if (a.hasNaN() || b.hasNaN())
      throw std::invalid_argument("a corner of the box is not a number; correct it");
    const std::vector<GridIndex> changed = kept_->clearBox({a.cwiseMin(b), a.cwiseMax(b)});
    mapChanged(changed);
    ROS_INFO("clear_bbx: cleared in %s", counted(changed.size(), "block").c_str());
    return true;
  } catch (const std::exception& fault) {
    // roscpp logs it, and sends it to the caller.
    throw std::runtime_error(std::string("clear_bbx: ") + fault.what());
  }
}

void MappingServer::saveMapFile(const std::string& path) {
  struct Parts {
    KeptMap::Saving saving;
    std::shared_ptr<const ServerSnapshot> snapshot;
  };
  const auto parts = QueuedCall<std::shared_ptr<Parts>>::ask(queue_, [&] {
    auto made = std::make_shared<Parts>();
    made->saving = kept_->saveTo(path);
    if (!made->saving.done.valid()) made->snapshot = std::make_shared<const ServerSnapshot>(snapshot());
    return made;
  });
  if (parts->snapshot) return saveMap(path, parts->saving.info, parts->saving.drives, parts->snapshot->map);
  while (parts->saving.done.wait_for(kFaultPoll) != std::future_status::ready) {
    const std::string fault = QueuedCall<std::string>::ask(queue_, [this] { return kept_->fileFault(); });
    if (!fault.empty()) throw MapFileError(fault);
  }
  parts->saving.done.get();
}

bool MappingServer::onSaveMap(SaveMap::Request& request, SaveMap::Response& response) {
  answer(response, [&] {
    checkPath(request.path);
    refuseCity(request.path);
    if (isMapFileName(request.path)) {
      saveMapFile(request.path);
      return "wrote " + request.path;
    }
    checkMapName(request.path);
    const std::string include = request.include.empty() ? "occupied" : request.include;
    const VoxelStates states = parseStates(include);
    const std::shared_ptr<const ServerSnapshot> snapshot = askForSnapshot();
    exportMap(request.path, snapshot->map, snapshot->rules, snapshot->classes, states);
    return "wrote " + request.path + " (" + include + (kept_->hasFile() ? ", of what is in memory)" : ")");
  });
  ROS_INFO("save_map: %s", response.message.c_str());
  return true;
}

bool MappingServer::onLoadMap(LoadMap::Request& request, LoadMap::Response& response) {
  answer(response, [&] {
    checkPath(request.path);
    struct Needed {
      MapInfo info;
      double memory_limit;  // [MB]
    };
    const Needed needed = QueuedCall<Needed>::ask(queue_, [this] {
      return Needed{kept_->info(), mapper_->config().memory_limit};
    });
    MapFile file(request.path, MapFile::Access::kRead);
    checkFits(file, needed.info);
    auto stored =
        std::make_shared<StoredMap>(readMap(file, static_cast<std::size_t>(1e6 * needed.memory_limit)));
    const std::string what = counted(stored->map.size(), "block") + " of " +
                             counted(stored->drives.size(), "drive") + " from " + request.path;
    QueuedCall<bool>::ask(queue_, [&] {
      kept_->addMap(std::move(*stored), !request.add, request.allow_overlap);
      if (!request.add) trajectory_.clear();
      wholeMapChanged();
      return true;
    });
    return (request.add ? "added " : "loaded ") + what;
  });
  ROS_INFO("load_map: %s", response.message.c_str());
  return true;
}

}  // namespace bki_mapping::ros_interface
