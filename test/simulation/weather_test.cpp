// Simulated weather: what it hides, what it adds, and that it is the same each time.
#include "simulation/weather.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "simulation/drive_file.h"
#include "simulation/lidar.h"
#include "temporary_folder.h"

namespace bki_mapping::simulation {
namespace {

DriveConfig driveIn(const std::string& weather) {
  DriveConfig config{2, 8.0, 1, lidarNamed("hdl32")};
  config.lidar.columns = 360;
  setWeather(weather, config.weather);
  return config;
}

SequenceFrame frameIn(const std::string& weather) {
  return Drive(driveIn(weather)).frame(1);
}

/// Ranges of the particles of a frame, rising [m].
std::vector<float> particles(const SequenceFrame& frame) {
  std::vector<float> ranges;
  for (std::size_t i = 0; i < frame.points.size(); ++i) {
    if (isParticle(frame.labels[i])) ranges.push_back(frame.points[i].norm());
  }
  std::sort(ranges.begin(), ranges.end());
  return ranges;
}

float farthestOf(const SequenceFrame& frame, std::uint32_t label) {
  float farthest = 0.0f;
  for (std::size_t i = 0; i < frame.points.size(); ++i) {
    if (frame.labels[i] == label) farthest = std::max(farthest, frame.points[i].norm());
  }
  return farthest;
}

TEST(Weather, IsNamedByKindAndRate) {
  WeatherConfig config;
  for (const std::string text : {"rain,12.5", "snow,1", "fog,50", "dust,30", "dry"}) {
    setWeather(text, config);
    EXPECT_EQ(nameOf(config), text);
  }
  for (const std::string text : {"", "hail,3", "rain", "rain,", "rain,0", "rain,201", "rain,-1", "rain,1,2",
                                 "rain,x", "rain,nan", "fog,4", "snow,1mm", "dry,1"}) {
    EXPECT_THROW(setWeather(text, config), std::invalid_argument) << text;
  }
  for (const std::string name : {"vegetation", "car", "person", "unlabelled", "mixed", "airborne"})
    EXPECT_EQ(nameOf(particleLabelsNamed(name)), name);
  EXPECT_THROW(particleLabelsNamed("plant"), std::invalid_argument);
}

TEST(Weather, DryAirAddsNothing) {
  const SequenceFrame frame = frameIn("dry");
  EXPECT_TRUE(particles(frame).empty());
  EXPECT_TRUE(std::none_of(frame.labels.begin(), frame.labels.end(), isNothing));
}

TEST(Weather, MostParticlesAreNearAndMoreFallMoreAreSeen) {
  for (const auto& [little, much] : {std::pair("rain,20", "rain,100"), std::pair("snow,0.5", "snow,3")}) {
    const std::vector<float> few = particles(frameIn(little)), many = particles(frameIn(much));
    ASSERT_GT(few.size(), 10u) << little;
    EXPECT_GT(many.size(), few.size() * 3 / 2) << much;
    EXPECT_GT(many.front(), 0.9f);
    EXPECT_LT(many[many.size() * 9 / 10], 20.0f);
    EXPECT_GT(many[many.size() / 2], 1.5f);
  }
}

TEST(Weather, SnowIsSeenFartherThanRain) {
  const std::vector<float> rain = particles(frameIn("rain,10")), snow = particles(frameIn("snow,1"));
  EXPECT_GT(snow[snow.size() / 2], rain[rain.size() / 2]);
  EXPECT_GT(snow.size(), 2 * rain.size());
}

TEST(Weather, FogShortensTheRange) {
  const float dry = farthestOf(frameIn("dry"), 50), thin = farthestOf(frameIn("fog,200"), 50),
              thick = farthestOf(frameIn("fog,50"), 50);
  EXPECT_GT(dry, 40.0f);
  EXPECT_LT(thin, dry);
  EXPECT_LT(thick, 25.0f);  // as Bijelic et al. (2018) saw with 50 m of sight
  EXPECT_GT(particles(frameIn("fog,50")).size(), particles(frameIn("fog,200")).size());
}

TEST(Weather, AWetRoadReturnsNothingFarAway) {
  EXPECT_GT(farthestOf(frameIn("dry"), 40), 40.0f);
  EXPECT_LT(farthestOf(frameIn("rain,2"), 40), 20.0f);
  EXPECT_GT(farthestOf(frameIn("snow,1"), 40), 30.0f) << "snow leaves the road dry";
}

TEST(Weather, ParticlesHaveTheLabelsAskedFor) {
  const auto labelsOf = [](ParticleLabels labels) {
    DriveConfig config = driveIn("snow,2");
    config.weather.labels = labels;
    std::set<std::uint32_t> found;
    for (const std::uint32_t label : Drive(config).frame(0).labels) {
      if (isParticle(label)) found.insert(label & 0xffffu);
    }
    return found;
  };
  EXPECT_EQ(labelsOf(ParticleLabels::kAsVegetation), (std::set<std::uint32_t>{70}));
  EXPECT_EQ(labelsOf(ParticleLabels::kMixed), (std::set<std::uint32_t>{0, 10, 30, 70}));
  EXPECT_EQ(labelsOf(ParticleLabels::kAirborne), (std::set<std::uint32_t>{kAirborneLabel}));
}

TEST(Weather, IsRepeatable) {
  EXPECT_EQ(frameIn("snow,1").points, frameIn("snow,1").points);
  EXPECT_EQ(frameIn("snow,1").labels, frameIn("snow,1").labels);
}

TEST(Weather, SteamFollowsCarsThatMove) {
  DriveConfig config = driveIn("dry");
  config.weather.steam = true;
  const Drive drive(config);
  const SequenceFrame frame = drive.frame(1);
  std::size_t steam = 0;
  for (std::size_t i = 0; i < frame.points.size(); ++i) {
    if (!isParticle(frame.labels[i])) continue;
    ++steam;
    const Eigen::Vector3d at = drive.T_world_sensor(1) * frame.points[i].cast<double>();
    double nearest = 1e9;
    for (const Shape& shape : drive.scene().shapes) {
      if (shape.label == 252) nearest = std::min(nearest, (shape.centreAt(drive.timeOf(1)) - at).norm());
    }
    EXPECT_LT(nearest, 4.5);
  }
  EXPECT_GT(steam, 10u);
}

TEST(Weather, PanesMirrorBeyondTheirWall) {
  DriveConfig config = driveIn("dry");
  config.lidar.range_noise = 0.0;
  config.weather.glass = true;
  const Drive drive(config);
  const SequenceFrame frame = drive.frame(1), without = frameIn("dry");
  std::size_t images = 0;
  for (std::size_t i = 0; i < frame.points.size(); ++i) {
    if (!isImage(frame.labels[i])) continue;
    ++images;
    // The beam passes a house on its way to the image.
    const Eigen::Vector3d origin = drive.T_world_sensor(1).translation();
    const Eigen::Vector3d end = drive.T_world_sensor(1) * frame.points[i].cast<double>();
    const Eigen::Vector3d direction = (end - origin).normalized();
    bool passes_house = false;
    for (const Shape& shape : drive.scene().shapes) {
      const auto range = shape.hit(origin, direction, drive.timeOf(1));
      passes_house |= shape.label == 50 && range && *range < (end - origin).norm();
    }
    EXPECT_TRUE(passes_house) << i;
  }
  EXPECT_GT(images, 20u);
  EXPECT_LT(frame.points.size(), without.points.size()) << "some beams pass";
}

TEST(Weather, IsStoredBesideTheDrive) {
  const TemporaryFolder folder;
  DriveConfig config = driveIn("snow,1.5");
  config.weather.labels = ParticleLabels::kMixed;
  config.weather.steam = true;
  writeDriveFile(folder / "", config);
  const auto read = readDriveFile(folder / "");
  ASSERT_TRUE(read);
  EXPECT_EQ(nameOf(read->weather), "snow,1.5");
  EXPECT_EQ(read->weather.labels, ParticleLabels::kMixed);
  EXPECT_TRUE(read->weather.steam);
  EXPECT_FALSE(read->weather.glass);
}

}  // namespace
}  // namespace bki_mapping::simulation
