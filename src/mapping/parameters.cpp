// The mapper's parameters: those without a group; the groups stand in ROOM/*_parameters.h, defaults in
// *_config.h.
#include "bki_mapping/mapping/mapper_config.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "bki_mapping/map/block.h"
#include "core/sensor_model_parameters.h"
#include "free_space/free_space_parameters.h"
#include "kernel/kernel_parameters.h"
#include "mapping/former_parameters.h"
#include "rules/class_sets.h"
#include "rules/rules_parameters.h"
#include "rules/scan_limit_parameters.h"

namespace bki_mapping {

std::vector<Parameter> mapperParameters() {
  using C = MapperConfig;
  std::vector<Parameter> all = {
      realParameter("resolution", &C::resolution,
                    NumberRange::atLeast(0.001).upTo(1000.0).slider(0.001, 100.0), "m", Changes::kAtStart,
                    "Edge length of a voxel. Smaller voxels show more detail and take more time and memory."),
      realParameter("prior", &C::prior, NumberRange::above(0.0).upTo(kMostEvidence), "", Changes::kAtStart,
                    "Concentration alpha0 that free and each class start with. Raise it to require more "
                    "evidence before a probability becomes certain. With rules/enabled it has no effect."),
      realParameter(
          "downsample_resolution", &C::downsample_resolution,
          NumberRange::atLeast(0.001).upTo(1000.0).orElse(0.0), "m", Changes::kAtStart,
          "Edge length of the cells in which hits, or free samples, are merged into one point. Larger "
          "cells take less time; set 0 to keep every point. With rules/enabled, a voxel holds a whole number "
          "of cells along each edge, at least two, of about this size; 0 keeps every point."),
  };
  appendParameters(all, "kernel/", &C::kernel, kernelParameters());
  appendParameters(all, "free_space/", &C::free_space, freeSpaceParameters());
  appendParameters(all, "rules/", &C::rules, rulesParameters());
  appendParameters(all, "scan_limit/", &C::scan_limit, scanLimitParameters());
  appendParameters(all, "sensor_model/", &C::sensor_model, sensorModelParameters());
  const std::vector<Parameter> others = {
      truthParameter(
          "clear_beyond_max_range", &C::clear_beyond_max_range, Changes::kWhileMapping,
          "Clear space up to sensor_model/max_range along beams whose hit lies beyond it. Set false "
          "if hits beyond the range can be false returns."),
      choiceParameter("occlusion", &C::occlusion, {"none", "mapped", "all"}, Changes::kWhileMapping,
                      "Which voxels without evidence are marked as occluded if they lie behind hits: none; "
                      "mapped marks those in blocks that exist already; all marks those in every block that "
                      "beams cross. Use all to plan views of hidden space."),
      choiceParameter("unlabelled_points", &C::unlabelled_points, {"occupied", "ignore"},
                      Changes::kWhileMapping,
                      "What hits of the class with the flag unlabelled do: occupied maps them as obstacles; "
                      "ignore drops them, so that they neither occupy nor clear."),
      choiceParameter("unknown_labels", &C::unknown_labels, {"ignore", "unlabelled"}, Changes::kAtStart,
                      "What to do with hits whose label is not in the class table: ignore drops them; "
                      "unlabelled maps them as the class with the flag unlabelled."),
      choiceParameter("label_values", &C::label_values, {"raw", "id"}, Changes::kAtStart,
                      "What the labels of points are: raw means the numbers of the data set, which the class "
                      "table translates; id means the ids of the class table."),
      realParameter("memory_limit", &C::memory_limit, NumberRange::atLeast(0.0).slider(0.0, 1e6), "MB",
                    Changes::kWhileMapping,
                    "Largest memory that the map may take; a scan that would exceed it is refused. Set it "
                    "below the computer's memory; 0 sets no limit."),
      integerParameter(
          "threads", &C::threads, NumberRange::atLeast(0).upTo(1024), Changes::kAtStart,
          "Number of threads that update the map. Set 0 to use all cores; the map does not depend "
          "on it."),
  };
  all.insert(all.end(), others.begin(), others.end());
  return all;
}

void setParameters(MapperConfig& config, const std::map<std::string, std::string>& values) {
  refuseFormerParameters(values);
  setNamedParameters(mapperParameters(), config, values);
}

void checkParameters(const MapperConfig& config) {
  checkNamedParameters(mapperParameters(), config);
}

void checkChanges(const MapperConfig& before, const MapperConfig& after) {
  for (const Parameter& p : mapperParameters()) {
    if (!p.changesWhileMapping() && !p.equal(before, after)) refuseChange(p);
  }
}

std::vector<std::string> settingWarnings(const MapperConfig& config) {
  std::vector<std::string> warnings;
  const double half_diagonal = 0.5 * std::sqrt(3.0) * config.resolution;
  if (config.kernel.type == KernelType::kSparse &&
      config.kernel.lengthFor(config.resolution) < half_diagonal) {
    warnings.push_back("kernel/length " + numberText(config.kernel.length) +
                       " m is below half a voxel's diagonal, " +
                       numberText(std::round(1e3 * half_diagonal) / 1e3) +
                       " m: hits that reach no voxel's centre are lost; leave kernel/length 0, or make "
                       "resolution finer");
  }
  if (config.rules.enabled && config.free_space.mode != "line") {
    warnings.push_back("rules/enabled needs whole beams to see what has left, but free_space/mode is " +
                       config.free_space.mode + "; set free_space/mode to line");
  }
  return warnings;
}

std::vector<std::string> settingWarnings(const MapperConfig& config, const ClassTable& classes) {
  std::vector<std::string> warnings = settingWarnings(config);
  const auto& all = classes.classes();
  const bool has_ground =
      std::any_of(all.begin(), all.end(), [](const SemanticClass& c) { return c.ground; });
  if (config.rules.enabled && !has_ground && !(config.sensor_model.height > 0.0)) {
    warnings.push_back(
        "class table '" + classes.name() +
        "' flags no class as ground, so scans do not show the height of the sensor, and voxels "
        "mostly in the ground may become free; set sensor_model/height");
  }
  return warnings;
}

MapperConfig applied(const MapperConfig& config) {
  MapperConfig result = config;
  if (!config.rules.enabled) return result;
  result.prior = RulesConfig::kPrior;
  result.kernel.scale = RulesConfig::kPeak;
  result.scan_rules = ScanRules(config.rules);
  result.scan_rules.void_margin = voidMargin(config.rules.void_margin, config.resolution);
  if (config.downsample_resolution > 0.0) {
    const double cells = std::round(config.resolution / config.downsample_resolution);
    result.downsample_resolution = config.resolution / std::max(cells, 2.0);
  }
  return result;
}

}  // namespace bki_mapping
