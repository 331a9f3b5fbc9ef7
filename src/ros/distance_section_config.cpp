#include "ros/distance_section_config.h"

#include <algorithm>
#include <sstream>
#include <stdexcept>

namespace bki_mapping::ros_interface {
namespace {

/// The words between commas, without surrounding blanks.
std::vector<std::string> wordsOf(const std::string& list) {
  std::vector<std::string> words;
  std::istringstream in(list);
  for (std::string word; std::getline(in, word, ',');) {
    const std::size_t begin = word.find_first_not_of(' ');
    if (begin == std::string::npos) continue;
    words.push_back(word.substr(begin, word.find_last_not_of(' ') + 1 - begin));
  }
  return words;
}

}  // namespace

std::vector<NamedParameter<DistanceSectionConfig>> distanceSectionParameters() {
  using C = DistanceSectionConfig;
  return {
      realParameter(
          "height", &C::height, NumberRange::any().slider(-100.0, 100.0), "m", Changes::kWhileMapping,
          "Height of distance_section above the sensor. Set it to the middle of the robot, which is "
          "mostly below the sensor."),
      realParameter("range", &C::range, NumberRange::above(0.0).upTo(1000.0).slider(1.0, 200.0), "m",
                    Changes::kWhileMapping,
                    "Distance from the sensor, along x and y, that distance_section shows at least."),
      realParameter("max_distance", &C::max_distance, NumberRange::above(0.0).upTo(1000.0).slider(0.5, 50.0),
                    "m", Changes::kWhileMapping,
                    "Distance to an obstacle at which the cells of distance_section become 0. The time for a "
                    "message grows with its square."),
      textParameter("classes", &C::classes, "names of classes, with commas between them", Changes::kAtStart,
                    "Classes that are obstacles for distance_section. Without names, these are the obstacles "
                    "of projected_map: all classes that are neither ground nor ignored in the class table."),
      truthParameter("unknown", &C::unknown, Changes::kWhileMapping,
                     "Unknown space is an obstacle for distance_section. Set true to keep away from what no "
                     "scan has seen."),
  };
}

ObstacleRules obstaclesOf(const DistanceSectionConfig& config, const ClassTable& table) {
  const std::vector<std::string> names = wordsOf(config.classes);
  if (!names.empty()) {
    try {
      return {ClassFilter::of(table, names), config.unknown};
    } catch (const std::invalid_argument& fault) {
      throw std::invalid_argument(std::string("parameter distance_section/classes: ") + fault.what());
    }
  }
  ClassFilter others;
  for (const SemanticClass& each : table.classes()) {
    if (each.ground || each.ignored) others.insert(each.id);
  }
  return {ClassFilter::allBut(others), config.unknown};
}

}  // namespace bki_mapping::ros_interface
