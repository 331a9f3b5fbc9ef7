#include "simulation/drive_file.h"

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <stdexcept>

#include "core/atomic_file.h"
#include "sequence/pose_file.h"
#include "sequence/trajectory_file.h"
#include "settings/yaml_file.h"

namespace bki_mapping::simulation {
namespace {

std::string pathIn(const std::string& folder, const char* name = "simulation.yaml") {
  return (std::filesystem::path(folder) / name).string();
}
constexpr char kTrajectory[] = "trajectory.txt";

/// Calls visit(name, value) for each setting, in the order of the file.
template <typename Config, typename Visit>
void forEachSetting(Config& config, Visit&& visit) {
  visit("scans", config.scans);
  visit("speed", config.speed);
  visit("height", config.height);
  visit("seed", config.seed);
  visit("beams", config.lidar.beams);
  visit("columns", config.lidar.columns);
  visit("lowest", config.lidar.lowest);
  visit("highest", config.lidar.highest);
  visit("max_range", config.lidar.max_range);
  visit("range_noise", config.lidar.range_noise);
  visit("label_noise", config.lidar.label_noise);
  visit("rate", config.lidar.rate);
  visit("noise_seed", config.lidar.seed);
  visit("steam", config.weather.steam);
  visit("glass", config.weather.glass);
}

}  // namespace

void writeDriveFile(const std::string& folder, const DriveConfig& config) {
  if (!config.trajectory.empty()) {
    std::string rows;
    for (const Eigen::Isometry3d& pose : config.trajectory) rows += rowOf(pose) + "\n";
    writeTextFile(pathIn(folder, kTrajectory), rows);
  }
  YAML::Emitter out;
  out.SetDoublePrecision(17);
  out << YAML::BeginMap << YAML::Key << "scene" << YAML::Value << nameOf(config.scene);
  out << YAML::Key << "weather" << YAML::Value << nameOf(config.weather);
  out << YAML::Key << "particle_labels" << YAML::Value << nameOf(config.weather.labels);
  forEachSetting(
      config, [&](const char* name, const auto& value) { out << YAML::Key << name << YAML::Value << value; });
  out << YAML::EndMap;
  writeTextFile(pathIn(folder), std::string(out.c_str()) + "\n");
}

std::optional<DriveConfig> readDriveFile(const std::string& folder) {
  const std::string path = pathIn(folder);
  if (!std::filesystem::exists(path)) return std::nullopt;
  try {
    const YAML::Node file = loadYamlFile(path);
    DriveConfig config;
    config.scene = sceneKindNamed(file["scene"].as<std::string>());
    if (file["weather"]) setWeather(file["weather"].as<std::string>(), config.weather);
    if (file["particle_labels"])
      config.weather.labels = particleLabelsNamed(file["particle_labels"].as<std::string>());
    forEachSetting(config, [&](const char* name, auto& value) {
      for (const char* later : {"height", "steam", "glass"}) {
        if (name == std::string(later) && !file[name]) return;  // a file of an earlier version
      }
      value = file[name].template as<std::decay_t<decltype(value)>>();
    });
    if (config.scene == SceneKind::kTrajectory)
      config.trajectory = readLidarPoses(pathIn(folder, kTrajectory), "", PosesIn::kLidar).poses;
    return config;
  } catch (const std::exception& fault) {
    throw std::runtime_error(path + " cannot be read (" + fault.what() +
                             "); write the drive again with simulate_drive");
  }
}

}  // namespace bki_mapping::simulation
