#include "ros/live_settings.h"

#include <ros/param.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "bki_mapping/mapping/mapper_config.h"

namespace bki_mapping::ros_interface {
namespace {

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

LiveSettings::LiveSettings(const ros::NodeHandle& private_node, const ServerConfig& server,
                           const MapperConfig& mapper, Apply apply, std::function<void()> answered)
    : server_(server), mapper_(mapper), apply_(std::move(apply)), answered_(std::move(answered)) {
  ros::NodeHandle node(private_node, "reconfigure");
  ros::param::del(node.getNamespace());  // values of an earlier run
  offered_ = std::make_unique<dynamic_reconfigure::Server<MappingConfig>>(mutex_, node);
  offered_->updateConfig(show(server_, mapper_));
  offered_->setCallback([this](MappingConfig& config, std::uint32_t) { onChange(config); });
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

void LiveSettings::onChange(MappingConfig& config) {
  ServerConfig server = server_;
  MapperConfig mapper = mapper_;
  try {
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
}

}  // namespace bki_mapping::ros_interface
