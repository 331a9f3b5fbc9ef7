#include "ros/live_settings.h"

#include <dynamic_reconfigure/ConfigDescription.h>
#include <ros/param.h>

#include <algorithm>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "bki_mapping/core/named_parameter.h"
#include "bki_mapping/mapping/mapper_config.h"

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

/// Checks that a message names only settings that `known` has, each once and with its type.
/// @throws std::invalid_argument that names those at fault.
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

/// The name as dynamic_reconfigure requires it: an identifier.
std::string identifierOf(std::string name) {
  std::replace(name.begin(), name.end(), '/', '_');
  return name;
}

/// The values of a configuration by identifier.
std::map<std::string, std::string> valuesOf(const MappingConfig& config) {
  dynamic_reconfigure::Config message;
  config.__toMessage__(message);
  std::map<std::string, std::string> values;
  for (const auto& p : message.bools) values[p.name] = p.value ? "true" : "false";
  for (const auto& p : message.ints) values[p.name] = std::to_string(p.value);
  for (const auto& p : message.doubles) values[p.name] = numberText(p.value);
  for (const auto& p : message.strs) values[p.name] = p.value;
  return values;
}

/// The values of all parameters by name.
std::map<std::string, std::string> valuesOf(const ServerConfig& server, const MapperConfig& mapper) {
  std::map<std::string, std::string> values;
  for (const auto& p : serverParameters()) values[p.name] = p.get(server);
  for (const auto& p : mapperParameters()) values[p.name] = p.get(mapper);
  return values;
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

LiveSettings::LiveSettings(const ros::NodeHandle& private_node, const ServerConfig& server,
                           const MapperConfig& mapper, Apply apply, std::function<void()> answered)
    : server_(server), mapper_(mapper), apply_(std::move(apply)), answered_(std::move(answered)) {
  offered_ = std::make_unique<ReconfigureServer>(
      private_node, show(server_, mapper_),
      [this](const dynamic_reconfigure::Config& asked) { return onChange(asked); });
}

MappingConfig LiveSettings::show(const ServerConfig& server, const MapperConfig& mapper) {
  MappingConfig config = MappingConfig::__getDefault__();
  dynamic_reconfigure::Config message;
  config.__toMessage__(message);
  std::map<std::string, std::string> values;
  for (const auto& [name, value] : valuesOf(server, mapper)) values[identifierOf(name)] = value;
  values[kLastRefusal] = "";
  for (auto& p : message.bools) p.value = values.at(p.name) == "true";
  for (auto& p : message.ints) p.value = std::stoi(values.at(p.name));
  for (auto& p : message.doubles) p.value = parseNumber(values.at(p.name));
  for (auto& p : message.strs) p.value = values.at(p.name);
  config.__fromMessage__(message);
  return config;
}

void LiveSettings::take(const MappingConfig& from, ServerConfig& server, MapperConfig& mapper) {
  const std::map<std::string, std::string> now = valuesOf(from);
  std::map<std::string, std::string> changed;
  const auto collect = [&](const auto& parameters, const auto& config) {
    for (const auto& p : parameters) {
      const auto found = now.find(identifierOf(p.name));
      if (found == now.end() || found->second == p.get(config)) continue;
      if (!p.changesWhileMapping()) refuseChange(p);
      changed[p.name] = found->second;
    }
  };
  collect(serverParameters(), server);
  collect(mapperParameters(), mapper);
  setParameters(changed, server, mapper);
}

MappingConfig LiveSettings::onChange(dynamic_reconfigure::Config asked) {
  ServerConfig server = server_;
  MapperConfig mapper = mapper_;
  MappingConfig config = show(server, mapper);
  try {
    checkSettings(asked, config);
    config.__fromMessage__(asked);
    take(config, server, mapper);
    if (valuesOf(server, mapper) != valuesOf(server_, mapper_)) apply_(server, mapper);
    server_ = server;
    mapper_ = mapper;
    last_refusal_.clear();
  } catch (const std::invalid_argument& fault) {
    last_refusal_ = fault.what();
    ROS_WARN("Settings stay as they were: %s", fault.what());
  }
  answered_();
  config = show(server_, mapper_);
  config.last_refusal = last_refusal_;
  return config;
}

}  // namespace bki_mapping::ros_interface
