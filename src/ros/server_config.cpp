#include "bki_mapping/ros/server_config.h"

#include <ros/param.h>

#include <stdexcept>

#include "bki_mapping/core/parameters.h"

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

}  // namespace

std::vector<NamedParameter<ServerConfig>> serverParameters() {
  using C = ServerConfig;
  return {
      textParameter<C>(
          "frame_id", "a frame of tf", "The map frame.", [](C & c) -> auto& { return c.frame_id; }),
      textParameter<C>(
          "label_field", "the name of a field, or empty",
          "Field of clouds with the label; with an empty name every point has the label 0.",
          [](C & c) -> auto& { return c.label_field; }),
      textParameter<C>(
          "classes", "a name of config/classes, or a YAML file", "The class table.",
          [](C & c) -> auto& { return c.classes; }),
      realParameter<C>(
          "tf_timeout", "a number >= 0", "s", "How long a cloud waits for its transform, in wall time.",
          [](C & c) -> auto& { return c.tf_timeout; }, [](double x) { return x >= 0.0; }),
      integerParameter<C>(
          "queue_size", 1, 10000, "Clouds that may wait; beyond it the oldest is dropped.",
          [](C & c) -> auto& { return c.queue_size; }),
      realParameter<C>(
          "publish_rate", "a number > 0", "Hz", "Maps are published at most this often.",
          [](C & c) -> auto& { return c.publish_rate; }, [](double x) { return x > 0.0; }),
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
    if (private_node.getParam(full, value)) {
      const std::string name = full.substr(prefix.size());
      values[name] = textOf(name, value);
    }
  }
  setParameters(values, server, mapper);
}

void setParameters(const std::map<std::string, std::string>& values, ServerConfig& server,
                   MapperConfig& mapper) {
  // One table of both kinds, so that one message lists every fault, and names near to a misspelt one.
  using Both = std::pair<ServerConfig, MapperConfig>;
  std::vector<NamedParameter<Both>> parameters;
  for (const auto& p : serverParameters()) {
    parameters.push_back({p.name, p.values, p.unit, p.description,
                          [p](Both& both, const std::string& value) { p.set(both.first, value); },
                          [p](const Both& both) { return p.get(both.first); }});
  }
  for (const auto& p : mapperParameters()) {
    parameters.push_back({p.name, p.values, p.unit, p.description,
                          [p](Both& both, const std::string& value) { p.set(both.second, value); },
                          [p](const Both& both) { return p.get(both.second); }});
  }
  Both both(server, mapper);
  setNamedParameters(parameters, both, values);
  if (both.first.occupancy_min_z > both.first.occupancy_max_z) {
    throw std::invalid_argument("parameter occupancy_min_z must not be above occupancy_max_z");
  }
  server = both.first;
  mapper = both.second;
}

}  // namespace bki_mapping::ros_shell
