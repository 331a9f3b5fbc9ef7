#include "ros/server_config.h"

#include <ros/param.h>

#include <set>
#include <stdexcept>

#include "bki_mapping/mapping/parameters.h"

namespace bki_mapping::ros_shell {
namespace {

std::string textOf(const std::string& name, XmlRpc::XmlRpcValue value) {
  switch (value.getType()) {
    case XmlRpc::XmlRpcValue::TypeBoolean:
      return static_cast<bool>(value) ? "true" : "false";
    case XmlRpc::XmlRpcValue::TypeInt:
      return std::to_string(static_cast<int>(value));
    case XmlRpc::XmlRpcValue::TypeDouble:
      return numberText(static_cast<double>(value));
    case XmlRpc::XmlRpcValue::TypeString:
      return static_cast<std::string>(value);
    default:
      throw std::invalid_argument("parameter '" + name + "' must be a number, a truth value or text");
  }
}

bool notNegative(double x) {
  return x >= 0.0;
}
bool positive(double x) {
  return x > 0.0;
}

/// What dynamic_reconfigure writes.
const std::string kLive = "reconfigure/";

/// What the names of inputs' parameters begin with.
const std::string kInputs = "inputs/";

/// NAME of each parameter inputs/NAME/...
std::set<std::string> inputNames(const std::map<std::string, std::string>& values) {
  std::set<std::string> names;
  for (const auto& [name, value] : values) {
    const std::size_t end = name.find('/', kInputs.size());
    if (name.compare(0, kInputs.size(), kInputs) == 0 && end != std::string::npos) {
      names.insert(name.substr(kInputs.size(), end - kInputs.size()));
    }
  }
  return names;
}

}  // namespace

std::vector<NamedParameter<ServerConfig>> serverParameters() {
  using C = ServerConfig;
  return {
      textParameter<C>(
          "frame_id", "a frame of tf", "The map frame.", [](C & c) -> auto& { return c.frame_id; }),
      textParameter<C>(
          "classes", "a name of config/classes, or a YAML file", "The class table.",
          [](C & c) -> auto& { return c.classes; }),
      realParameter<C>(
          "tf_timeout", "a number >= 0", "s", "How long a cloud waits for its transform, in wall time.",
          [](C & c) -> auto& { return c.tf_timeout; }, notNegative),
      integerParameter<C>(
          "queue_size", 1, 10000, "Clouds that may wait.", [](C & c) -> auto& { return c.queue_size; }),
      choiceParameter<C>(
          "queue_policy", {"drop_oldest", "drop_newest"}, "Which cloud is dropped when the queue is full.",
          [](C & c) -> auto& { return c.queue_policy; }),
      choiceParameter<C>(
          "on_time_jump", {"keep", "reset"},
          "What becomes of the map when time jumps back, as it does when a bag starts again.",
          [](C & c) -> auto& { return c.on_time_jump; }),
      realParameter<C>(
          "window", "a number >= 0", "m",
          "Edge of the cube about the sensor outside of which blocks and poses of the trajectory are "
          "forgotten; 0: nothing is forgotten.",
          [](C & c) -> auto& { return c.window; }, notNegative),
      realParameter<C>(
          "diagnostic_period", "a number > 0", "s", "Time between reports on /diagnostics.",
          [](C & c) -> auto& { return c.diagnostic_period; }, positive),
      realParameter<C>(
          "publish_rate", "a number > 0", "Hz",
          "Each map topic is published at most this often, and less often if it would take more than a tenth "
          "of "
          "the time.",
          [](C & c) -> auto& { return c.publish_rate; }, positive),
      realParameter<C>(
          "view_range", "a number >= 0", "m",
          "How far around the sensor markers and voxel_cloud show the map, on each axis; 0: all of it.",
          [](C & c) -> auto& { return c.view_range; }, notNegative),
      realParameter<C>(
          "view_min_z", "a number", "m",
          "Lower end of the heights that markers and voxel_cloud show, in the map frame.",
          [](C & c) -> auto& { return c.view_min_z; }, [](double) { return true; }),
      realParameter<C>(
          "view_max_z", "a number", "m",
          "Upper end of the heights that markers and voxel_cloud show, in the map frame.",
          [](C & c) -> auto& { return c.view_max_z; }, [](double) { return true; }),
      choiceParameter<C>(
          "latch", {"false", "true"}, "Whether map topics are latched.",
          [](C & c) -> auto& { return c.latch; }),
      choiceParameter<C>(
          "color_mode", {"semantics", "probability", "variance", "height"},
          "What the colours of occupied_cells_vis_array show.", [](C & c) -> auto& { return c.color_mode; }),
      realParameter<C>(
          "occupancy_min_z", "a number", "m", "Lower end of the space that projected_map shows.",
          [](C & c) -> auto& { return c.occupancy_min_z; }, [](double) { return true; }),
      realParameter<C>(
          "occupancy_max_z", "a number", "m", "Upper end of the space that projected_map shows.",
          [](C & c) -> auto& { return c.occupancy_max_z; }, [](double) { return true; }),
      choiceParameter<C>(
          "occupancy_height", {"map", "ground"},
          "From where occupancy_min_z and occupancy_max_z are measured: the map frame's origin, or the "
          "ground "
          "below; obstacles without known ground below count at any height then.",
          [](C & c) -> auto& { return c.occupancy_height; }),
      choiceParameter<C>(
          "full_projected_map", {"false", "true"},
          "Whether projected_map is sent whole each time, for listeners that leave projected_map_updates "
          "out.",
          [](C & c) -> auto& { return c.full_projected_map; }),
  };
}

void readParameters(const ros::NodeHandle& private_node, ServerConfig& server, MapperConfig& mapper) {
  const std::string prefix = private_node.getNamespace() + "/";
  std::vector<std::string> names;
  private_node.getParamNames(names);
  std::map<std::string, std::string> values;
  for (const std::string& full : names) {
    if (full.compare(0, prefix.size(), prefix) != 0) continue;
    XmlRpc::XmlRpcValue value;
    const std::string name = full.substr(prefix.size());
    if (name.compare(0, kLive.size(), kLive) != 0 && private_node.getParam(full, value)) {
      values[name] = textOf(name, value);
    }
  }
  setParameters(values, server, mapper);
}

std::vector<InputConfig> allInputs(const ServerConfig& server, const MapperConfig& mapper) {
  InputConfig common = server.input;
  common.sensor_model = mapper.sensor_model;
  if (server.inputs.empty()) return {common};
  std::vector<InputConfig> inputs;
  for (const auto& [name, values] : server.inputs) {
    InputConfig input = common;
    input.topic = name;
    setNamedParameters(ownInputParameters(), input, values);
    inputs.push_back(input);
  }
  return inputs;
}

void setParameters(const std::map<std::string, std::string>& values, ServerConfig& server,
                   MapperConfig& mapper) {
  // One table of all kinds, so that one message lists every fault, and names near to a misspelt one.
  using Both = std::pair<ServerConfig, MapperConfig>;
  std::vector<NamedParameter<Both>> parameters;
  const auto append = [&](const auto& table, auto part) {
    for (const auto& p : table) {
      parameters.push_back({p.name, p.values, p.unit, p.description,
                            [p, part](Both& both, const std::string& value) { p.set(part(both), value); },
                            [p, part](const Both& both) { return p.get(part(const_cast<Both&>(both))); }});
    }
  };
  append(
      serverParameters(), [](Both & both) -> auto& { return both.first; });
  append(
      inputParameters(), [](Both & both) -> auto& { return both.first.input; });
  append(
      mapperParameters(), [](Both & both) -> auto& { return both.second; });
  for (const std::string& name : inputNames(values)) {
    for (const auto& p : ownInputParameters()) {
      const auto set = [p, name](Both& both, const std::string& value) {
        InputConfig checked;
        p.set(checked, value);
        both.first.inputs[name][p.name] = value;
      };
      parameters.push_back({kInputs + name + "/" + p.name, p.values, p.unit, p.description, set, nullptr});
    }
  }
  Both both(server, mapper);
  setNamedParameters(parameters, both, values);
  if (both.first.occupancy_min_z > both.first.occupancy_max_z) {
    throw std::invalid_argument("parameter occupancy_min_z must not be above occupancy_max_z");
  }
  if (both.first.view_min_z > both.first.view_max_z) {
    throw std::invalid_argument("parameter view_min_z must not be above view_max_z");
  }
  for (const InputConfig& input : allInputs(both.first, both.second)) {
    if (input.clear_no_returns && input.sensor_model.max_range <= 0.0) {
      throw std::invalid_argument(
          "clear_no_returns needs to know how far beams reach; set sensor_model/max_range");
    }
  }
  server = both.first;
  mapper = both.second;
}

}  // namespace bki_mapping::ros_shell
