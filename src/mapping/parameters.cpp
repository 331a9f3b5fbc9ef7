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
#include "rules/free_gain_parameters.h"
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
                    "evidence before a probability becomes certain."),
      realParameter(
          "downsample_resolution", &C::downsample_resolution,
          NumberRange::atLeast(0.001).upTo(1000.0).orElse(0.0), "m", Changes::kAtStart,
          "Edge length of the cells in which hits, or free samples, are merged into one point. Larger "
          "cells take less time; set 0 to keep every point."),
  };
  appendParameters(all, "kernel/", &C::kernel, kernelParameters());
  appendParameters(all, "free_space/", &C::free_space, freeSpaceParameters());
  appendParameters(all, "free_space/", &C::scan_limit, missParameters());
  appendParameters(all, "free_gain/", &C::free_gain, freeGainParameters());
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
  for (const auto& [name, limit] :
       {std::pair("hits", config.scan_limit.hits), std::pair("free", config.scan_limit.free),
        std::pair("void", config.scan_limit.void_space)}) {
    if (limit == 0.0 || unitsOf(std::min(limit, 1.0)) > 0) continue;
    warnings.push_back(
        "scan_limit/" + std::string(name) + " " + numberText(limit) +
        " is below the smallest evidence, 1.5e-5: the scans add none; raise it, or set 0 for no limit");
  }
  if (config.scan_limit.void_space > 0.0 && config.scan_limit.free == 0.0) {
    warnings.push_back(
        "scan_limit/void adds nothing without scan_limit/free, which says what counts as seen empty; set "
        "scan_limit/free, such as 0.1");
  }
  if (config.free_gain.latest && config.scan_limit.free == 0.0) {
    warnings.push_back(
        "free_gain/latest sees nothing leave without scan_limit/free, which says what counts as seen empty; "
        "set "
        "scan_limit/free, such as 0.1");
  }
  return warnings;
}

std::vector<std::string> settingWarnings(const MapperConfig& config, const ClassTable& classes) {
  std::vector<std::string> warnings = settingWarnings(config);
  const FreeGainConfig& gain = config.free_gain;
  const double moving = std::max(gain.dynamic_classes, gain.ofLiving());
  if (!classes.saysWhatMoves() && moving > gain.static_classes) {
    warnings.push_back("class table '" + classes.name() +
                       "' flags no class as dynamic, so free_gain/static " + numberText(gain.static_classes) +
                       " applies to all, and what has left stays in the map; take the preset occupancy_only, "
                       "or flag the classes that can move");
  }
  return warnings;
}

}  // namespace bki_mapping
