#include "ros/reconfigure_server.h"

#include <dynamic_reconfigure/ConfigDescription.h>
#include <ros/param.h>

#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "bki_mapping/core/named_parameter.h"

namespace bki_mapping::ros_interface {
namespace {

using dynamic_reconfigure::Config;

constexpr std::size_t kMostFaults = 5;  ///< that one sentence names

/// Calls visit(name, type) for each setting of a message.
template <typename Visit>
void eachSetting(const Config& message, Visit&& visit) {
  for (const auto& p : message.bools) visit(p.name, "true or false");
  for (const auto& p : message.ints) visit(p.name, "an integer");
  for (const auto& p : message.doubles) visit(p.name, "a floating-point number");
  for (const auto& p : message.strs) visit(p.name, "text");
}

}  // namespace

ReconfigureServer::ReconfigureServer(ros::NodeHandle private_node, const MappingConfig& config, Change change)
    : values_(private_node, "reconfigure"), change_(std::move(change)) {
  ros::param::del(values_.getNamespace());  // values of an earlier run
  descriptions_ = private_node.advertise<dynamic_reconfigure::ConfigDescription>(
      "reconfigure/parameter_descriptions", 1, true);
  descriptions_.publish(MappingConfig::__getDescriptionMessage__());
  updates_ = private_node.advertise<Config>("reconfigure/parameter_updates", 1, true);
  publish(config);
  service_ = private_node.advertiseService("reconfigure/set_parameters", &ReconfigureServer::onSet, this);
}

void ReconfigureServer::publish(const MappingConfig& config) {
  config.__toServer__(values_);
  Config message;
  config.__toMessage__(message);
  updates_.publish(message);
}

bool ReconfigureServer::onSet(dynamic_reconfigure::Reconfigure::Request& request,
                              dynamic_reconfigure::Reconfigure::Response& response) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const MappingConfig config = change_(request.config);
  publish(config);
  config.__toMessage__(response.config);
  return true;
}

void checkSettings(const Config& asked, const MappingConfig& known) {
  Config message;
  known.__toMessage__(message);
  std::map<std::string, std::string> types;
  std::vector<std::string> names;
  eachSetting(message, [&](const std::string& name, const std::string& type) {
    types[name] = type;
    names.push_back(name);
  });
  std::set<std::string> seen;
  std::vector<std::string> faults;
  eachSetting(asked, [&](const std::string& name, const std::string& type) {
    if (faults.size() == kMostFaults) return;
    const std::string shown = shortText(name);
    const auto found = types.find(name);
    if (found == types.end()) {
      faults.push_back("setting '" + shown + "' is unknown" + nearestWord(shown, names));
    } else if (found->second != type) {
      faults.push_back("setting " + shown + " is " + type + ", but must be " + found->second);
    } else if (!seen.insert(name).second) {
      faults.push_back("setting " + shown + " is given twice; keep one");
    }
  });
  std::string text;
  for (const std::string& fault : faults) text += (text.empty() ? "" : "; ") + fault;
  if (!text.empty()) throw std::invalid_argument(text);
}

}  // namespace bki_mapping::ros_interface
