#include "ros/map_file_settings.h"

#include <stdexcept>

#include "bki_mapping/city/tiled_map.h"
#include "bki_mapping/store/mapper_file.h"
#include "ros/city_tiles.h"

namespace bki_mapping::ros_interface {
namespace {

/// @param others what else the parameter may be.
void checkMapFilePath(const std::string& parameter, const std::string& path, const std::string& others = "") {
  if (path.front() != '/') {
    throw std::invalid_argument(parameter + " '" + path + "' must be an absolute path");
  }
  if (!isMapFileName(path))
    throw std::invalid_argument(parameter + " '" + path + "' must end in .bkm" + others);
}

void refuseInCity(const std::string& parameter, const std::string& path) {
  const std::string city = cityAround(path);
  if (city.empty()) return;
  throw std::invalid_argument(parameter + " '" + path + "' is in the city " + city +
                              ", which only map_city may change; name a file elsewhere, or the city itself");
}

void checkCitySettings(const ServerConfig& config) {
  if (config.map_file.front() != '/') {
    throw std::invalid_argument("map_file '" + config.map_file + "' must be an absolute path");
  }
  if (config.read_only) {
    throw std::invalid_argument(
        "read_only publishes a whole map, but a city is loaded near the sensor; set read_only "
        "to false, or name a map file (.bkm)");
  }
  if (config.window > 0.0 && config.own_map_file.empty()) {
    throw std::invalid_argument(
        "window moves evidence to a file, but a city is never changed; set own_map_file, or "
        "window to 0");
  }
  if (config.own_map_file.empty()) return;
  checkMapFilePath("own_map_file", config.own_map_file);
  refuseInCity("own_map_file", config.own_map_file);
}

}  // namespace

void checkMapFileSettings(const ServerConfig& config) {
  if (config.correction.journal && config.window > 0.0 && config.map_file.empty()) {
    throw std::invalid_argument(
        "journal needs all that its scans have mapped, but window removes what is far from the sensor; set "
        "map_file, which keeps it, or window to 0");
  }
  if (namesCity(config.map_file)) return checkCitySettings(config);
  if (!config.own_map_file.empty()) {
    throw std::invalid_argument(
        "own_map_file is for a mapper whose map_file is a city; set map_file to the folder of "
        "a city, or to '" +
        config.own_map_file + "' instead");
  }
  if (config.map_file.empty()) {
    if (config.read_only) throw std::invalid_argument("read_only needs a map; set map_file");
    return;
  }
  checkMapFilePath("map_file", config.map_file, ", or be the folder of a city");
  if (!config.read_only) refuseInCity("map_file", config.map_file);
}

}  // namespace bki_mapping::ros_interface
