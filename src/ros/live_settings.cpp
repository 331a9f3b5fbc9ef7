#include "ros/live_settings.h"

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
