#include "ros/server_config.h"

#include <ros/param.h>

#include <set>
#include <stdexcept>
#include <utility>

#include "bki_mapping/mapping/mapper_config.h"
#include "bki_mapping/settings/yaml.h"
#include "core/frame_name.h"
#include "mapping/former_parameters.h"

namespace bki_mapping::ros_interface {
namespace {

/// The rows of the parameters, which have no common prefix.
std::vector<NamedParameter<CorrectionConfig>> correctionParameters() {
  using C = CorrectionConfig;
  return {
      truthParameter("journal", &C::journal, Changes::kAtStart,
                     "Keep all scans, so that the map follows corrected_path. Set true where a SLAM system "
                     "corrects the poses of the past. With window it needs map_file, whose journal then "
                     "keeps them."),
      realParameter(
          "journal_quantum", &C::journal_quantum, NumberRange::atLeast(0.0001).upTo(1.0).orElse(0.0), "m",
          Changes::kAtStart,
          "Points of kept scans are rounded to multiples of this in the sensor's frame, before they "
          "are mapped. Raise it to save memory. 0 stands for 0.01, or for a hundredth of resolution where "
          "that is below 0.3 m."),
      realParameter(
          "journal_limit", &C::journal_limit, NumberRange::atLeast(0.0), "MB", Changes::kAtStart,
          "Largest memory of kept scans. Beyond it the oldest ones are read from map_file when they "
          "move; without map_file they are forgotten, and stay in the map where they are. 0 sets no "
          "limit."),
      realParameter("correction/tolerance", &C::tolerance, NumberRange::atLeast(0.0).orElse(-1.0), "m",
                    Changes::kAtStart,
                    "Scans stay where they are while no point is farther than this from where corrected_path "
                    "puts it. -1 stands for a tenth of resolution; 0 moves all."),
      frameParameter("corrected_frame_id", &C::corrected_frame_id, "a frame of tf, or empty",
                     Changes::kAtStart,
                     "Frame of the robot whose poses corrected_path has, for example base_link; it must not "
                     "move relative to the sensor. Empty: the sensor's frame."),
      frameParameter("odometry_frame_id", &C::odometry_frame_id, "a frame of tf, or empty", Changes::kAtStart,
                     "Frame in which the poses of the robot never jump, for example odom. Scans between two "
                     "poses of corrected_path keep the shape of their way in it. Empty: frame_id, in which "
                     "scans beside a jump of tf are then a little off."),
  };
}

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

/// What dynamic_reconfigure writes.
const std::string kLive = "reconfigure/";

/// The parameter that names a file of parameters.
const std::string kConfig = "config";

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

/// The parameters in a file. @throws std::invalid_argument also if it names another file.
std::map<std::string, std::string> fileParameters(const std::string& file) {
  std::map<std::string, std::string> values = loadParameterFile(file);
  if (values.count(kConfig) != 0) {
    throw std::invalid_argument("parameter file " + file +
                                " names another one as config; put all in one file");
  }
  return values;
}

/// What setParameters sets: one table of all kinds, so that one message lists every fault, and names near to
/// a misspelt one.
struct Both {
  ServerConfig server;
  MapperConfig mapper;
};

/// The access to a parameter of one input, whose text is kept.
class InputAccess : public ParameterAccess<Both> {
 public:
  InputAccess(std::string input, NamedParameter<InputConfig> parameter)
      : input_(std::move(input)), parameter_(std::move(parameter)) {}

  bool assign(const ParameterFacts&, Both& both, const std::string& value) const override {
    InputConfig checked;
    const bool allowed = parameter_.assign(checked, value);
    if (allowed) both.server.inputs[input_][parameter_.name] = value;
    return allowed;
  }
  std::string get(const ParameterFacts&, const Both& both) const override { return textIn(both); }
  // No other value is ever kept.
  bool allowed(const ParameterFacts&, const Both&) const override { return true; }
  bool equal(const Both& a, const Both& b) const override { return textIn(a) == textIn(b); }

 private:
  std::string textIn(const Both& both) const {
    const auto input = both.server.inputs.find(input_);
    if (input == both.server.inputs.end()) return "";
    const auto value = input->second.find(parameter_.name);
    return value == input->second.end() ? "" : value->second;
  }
  std::string input_;
  NamedParameter<InputConfig> parameter_;
};

/// inputParameters of all inputs.
std::vector<NamedParameter<ServerConfig>> inputParametersOfServer() {
  std::vector<NamedParameter<ServerConfig>> parameters;
  appendParameters(parameters, "", &ServerConfig::input, inputParameters());
  return parameters;
}

}  // namespace

std::vector<NamedParameter<ServerConfig>> serverParameters() {
  using C = ServerConfig;
  const NumberRange height = NumberRange::any().slider(-1e6, 1e6);
  const NumberRange length = NumberRange::atLeast(0.0).slider(0.0, 1e4);
  std::vector<NamedParameter<C>> parameters = {
      frameParameter("frame_id", &C::frame_id, "a frame of tf", Changes::kAtStart,
                     "Name of the map frame. Set it to a frame that does not move with the robot."),
      textParameter("classes", &C::classes, "a name of config/classes, or a YAML file", Changes::kAtStart,
                    "Class table: the names, colours and flags of the labels. Set it to the table of the "
                    "network that labels the points."),
      textParameter(
          "config", &C::config, "a name of config/presets, or a YAML file", Changes::kAtStart,
          "Parameters to start from: a preset or a file of your own. Parameters that the node is given "
          "itself go before those of the file. Empty: the defaults."),
      realParameter(
          "tf_timeout", &C::tf_timeout, NumberRange::atLeast(0.0).slider(0.0, 60.0), "s",
          Changes::kWhileMapping,
          "How long a cloud waits for its transform, in wall time, before it is dropped. Raise it if "
          "poses arrive late."),
      integerParameter("queue_size", &C::queue_size, NumberRange::atLeast(1).upTo(10000),
                       Changes::kWhileMapping,
                       "Number of clouds that may wait to be mapped. Raise it to map every cloud of a burst, "
                       "lower it to keep the map recent."),
      choiceParameter(
          "queue_policy", &C::queue_policy, {"drop_oldest", "drop_newest"}, Changes::kWhileMapping,
          "Which cloud is dropped when the queue is full. Use drop_oldest to keep the map recent."),
      choiceParameter(
          "on_time_jump", &C::on_time_jump, {"keep", "reset"}, Changes::kWhileMapping,
          "What happens to the map when time jumps back, for example when a bag starts again: keep "
          "continues it, reset starts an empty one."),
      realParameter(
          "window", &C::window, length, "m", Changes::kWhileMapping,
          "Edge length of a cube around the sensor. Blocks outside it are removed, or move to map_file until "
          "the sensor comes back; poses of the trajectory outside it are removed. Set it to bound memory on "
          "long drives; 0 keeps everything in memory."),
      textParameter(
          "map_file", &C::map_file, "an absolute path that ends in .bkm, or of the folder of a city",
          Changes::kAtStart,
          "Map file that the mapper continues: loaded at the start, and saved every save_period and "
          "at the end. It is created if missing. Without it, the map ends with the mapper. The folder of a "
          "city of map_city is never changed: the mapper loads what is near the sensor, and keeps its map in "
          "own_map_file."),
      textParameter("own_map_file", &C::own_map_file, "an absolute path that ends in .bkm", Changes::kAtStart,
                    "New map file for a mapper whose map_file is a city: keeps what it loads from the city "
                    "and what it maps. Without it, both end with the mapper; window needs it."),
      realParameter("map_load_radius", &C::map_load_radius, NumberRange::above(0.0).slider(1.0, 1e4), "m",
                    Changes::kWhileMapping,
                    "Distance from the sensor, along each axis, up to which the mapper loads a city in "
                    "map_file; with window, at most half of it. Raise it to plan farther ahead, lower it to "
                    "save memory."),
      truthParameter("read_only", &C::read_only, Changes::kAtStart,
                     "Publish the map in map_file, and take no clouds. Set true for a finished map."),
      realParameter("save_period", &C::save_period, NumberRange::atLeast(0.0).slider(0.0, 3600.0), "s",
                    Changes::kWhileMapping,
                    "Time between two saves of map_file. Lower it to lose less when the power fails; 0 saves "
                    "only at the end, and with a journal when much waits for it."),
      realParameter("diagnostic_period", &C::diagnostic_period, NumberRange::above(0.0), "s",
                    Changes::kAtStart, "Time between two reports on /diagnostics."),
      realParameter(
          "publish_rate", &C::publish_rate, NumberRange::above(0.0).slider(0.001, 1000.0), "Hz",
          Changes::kWhileMapping,
          "Highest rate at which each map topic is published. The rate falls where publishing would "
          "take more than a tenth of the time."),
      realParameter("view_range", &C::view_range, length, "m", Changes::kWhileMapping,
                    "Distance from the sensor, along each axis, up to which the markers and voxel_cloud show "
                    "the map. Set it to keep rviz fast; 0 shows all."),
      realParameter("view_min_z", &C::view_min_z, height, "m", Changes::kWhileMapping,
                    "Lowest height in the map frame that the markers and voxel_cloud show."),
      realParameter(
          "view_max_z", &C::view_max_z, height, "m", Changes::kWhileMapping,
          "Greatest height in the map frame that the markers and voxel_cloud show. Lower it to look "
          "under ceilings and trees."),
      truthParameter(
          "latch", &C::latch, Changes::kAtStart,
          "Latch voxel_cloud, occupancy, trajectory and distance_section: a new subscriber receives the "
          "last message at once."),
      choiceParameter("color_mode", &C::color_mode, {"semantics", "probability", "variance", "height"},
                      Changes::kWhileMapping,
                      "Property of a voxel that the colours of occupied_cells_vis_array show."),
      realParameter("occupancy_min_z", &C::occupancy_min_z, height, "m", Changes::kWhileMapping,
                    "Lowest height at which projected_map looks for obstacles. Set it to what the robot can "
                    "drive over."),
      realParameter("occupancy_max_z", &C::occupancy_max_z, height, "m", Changes::kWhileMapping,
                    "Greatest height at which projected_map looks for obstacles. Set it to the height of the "
                    "robot."),
      choiceParameter(
          "occupancy_height", &C::occupancy_height, {"map", "ground"}, Changes::kAtStart,
          "Zero of occupancy_min_z and occupancy_max_z: the origin of the map frame, or the ground "
          "below. Use ground on slopes; where no ground is known, obstacles then count at any "
          "height."),
      truthParameter("full_projected_map", &C::full_projected_map, Changes::kAtStart,
                     "Publish projected_map whole each time instead of its changes on projected_map_updates. "
                     "Set true for listeners that do not read the updates."),
  };
  appendParameters(parameters, "distance_section/", &C::distance_section, distanceSectionParameters());
  appendParameters(parameters, "", &C::correction, correctionParameters());
  return parameters;
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
  if (const auto config = values.find(kConfig); config != values.end() && !config->second.empty()) {
    values.merge(fileParameters(config->second));
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
  refuseFormerParameters(values);
  std::vector<NamedParameter<Both>> parameters;
  appendParameters(parameters, "", &Both::server, serverParameters());
  appendParameters(parameters, "", &Both::server, inputParametersOfServer());
  appendParameters(parameters, "", &Both::mapper, mapperParameters());
  for (const std::string& name : inputNames(values)) {
    for (const auto& p : ownInputParameters()) {
      ParameterFacts facts = p;
      facts.name = kInputs + name + "/" + p.name;
      parameters.push_back({facts, std::make_shared<InputAccess>(name, p)});
    }
  }
  Both both = {server, mapper};
  setNamedParameters(parameters, both, values);
  if (both.server.frame_id.empty()) {
    throw std::invalid_argument("parameter frame_id must name the map frame");
  }
  if (both.server.occupancy_min_z > both.server.occupancy_max_z) {
    throw std::invalid_argument("parameter occupancy_min_z must not be above occupancy_max_z");
  }
  if (both.server.view_min_z > both.server.view_max_z) {
    throw std::invalid_argument("parameter view_min_z must not be above view_max_z");
  }
  for (const InputConfig& input : allInputs(both.server, both.mapper)) {
    if (input.clear_no_returns && input.sensor_model.max_range <= 0.0) {
      throw std::invalid_argument(
          "clear_no_returns needs to know how far beams reach; set sensor_model/max_range");
    }
  }
  server = both.server;
  mapper = both.mapper;
}

}  // namespace bki_mapping::ros_interface
