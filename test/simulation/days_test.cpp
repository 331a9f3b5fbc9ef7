// Three days in one street with other parked cars each day, mapped one by one and merged: the map shows the
// cars of the last day that looked at a place, and of each other place those of the day before.
#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <set>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/rules/voxel_state.h"
#include "bki_mapping/settings/yaml.h"
#include "bki_mapping/store/map_merge.h"
#include "bki_mapping/store/mapper_file.h"
#include "evaluation/passing_beams.h"
#include "simulation/lidar.h"
#include "simulation/street_parts.h"
#include "simulation/voxel_truth.h"
#include "temporary_folder.h"

namespace bki_mapping::simulation {
namespace {

constexpr std::uint64_t kDay = 86'400'000'000'000;  // [ns]
constexpr double kStep = 0.1;                       // from scan to scan, at walking pace [m]
constexpr double kRange = 10.0;                     // of the lidar [m]
constexpr int kClear = 3;  // scans whose beams pass through a voxel, that show beyond doubt that it is empty

/// A drive along the street on one day, and what its beams met.
class DayInTheStreet {
 public:
  /// @param way how far the sensor drives [m].
  DayInTheStreet(int day, double way) : end_(way + kRange) {
    const std::string config = std::string(BKI_MAPPING_SOURCE_DIR) + "/config/";
    MapperConfig settings;
    setParameters(settings, loadParameterFile(config + "presets/robot.yaml"));
    mapper_ = std::make_unique<SemanticMapper>(
        settings, std::make_shared<const ClassTable>(loadClassTable(config + "classes/semantic_kitti.yaml")));
    LidarConfig lidar = lidarNamed("hdl32");
    lidar.columns = 360;
    lidar.max_range = kRange;
    const Scene scene = streetOf(day);
    truth_ = std::make_unique<VoxelTruth>(scene, Eigen::Isometry3d::Identity(), geometry());
    record_.id = "day " + std::to_string(day);
    for (std::size_t n = 0; kStep * static_cast<double>(n) < way; ++n) {
      Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();
      T_world_sensor.translation() = Eigen::Vector3d(kStep * static_cast<double>(n), -1.5, 1.73);
      SequenceFrame frame =
          simulation::scan(scene, lidar, T_world_sensor, 0.0, 1000 * static_cast<std::uint64_t>(day) + n);
      frame.T_map_sensor = T_world_sensor;
      frame.stamp = Sequence::kFirstStamp + kDay * static_cast<std::uint64_t>(day) + 100'000'000 * n;
      scans_.push_back(frame.scan());
      mapper_->integrate(scans_.back());
      record_.addScan(frame.stamp, geometry(), mapper_->touchedBlocks());
      for (std::size_t i = 0; i < frame.points.size(); ++i) {
        const VoxelIndex voxel = geometry().voxelAt(T_world_sensor * frame.points[i].cast<double>());
        hit_.insert(voxel);
        if (frame.labels[i] == kCar) cars_.insert(voxel);
      }
    }
  }
  const GridGeometry& geometry() const { return mapper_->map().geometry(); }
  const SemanticMapper& mapper() const { return *mapper_; }
  /// Voxels that hits on cars are in.
  const std::set<VoxelIndex>& cars() const { return cars_; }
  bool hits(const VoxelIndex& voxel) const { return hit_.count(voxel) > 0; }
  /// Whether a car is within a voxel's edge on that day.
  bool isNearCar(const VoxelIndex& voxel) const {
    return truth_->isNear(voxel, 0.0, geometry().resolution(),
                          [](std::uint32_t label) { return label == kCar; });
  }
  /// Whether no part of a car that reaches into the voxel was in sight of the sensor.
  bool isBeyond(const VoxelIndex& voxel) const { return geometry().voxelCentre(voxel).x() > end_ + 5.0; }
  void save(const std::string& path) const {
    saveMap(path, mapInfoOf(*mapper_, "map"), {record_}, mapper_->map());
  }
  bool showsOccupied(const VoxelIndex& voxel) const {
    return viewWithoutEntropy(mapper_->map(), mapper_->rules(), voxel).state == VoxelState::kOccupied;
  }
  /// For each voxel, the number of scans with a beam that passes within a distance of its centre [m].
  std::map<VoxelIndex, int> passes(const std::set<VoxelIndex>& voxels, double distance) const {
    std::map<VoxelIndex, int> passes;
    PassingBeams beams;
    for (const Scan& scan : scans_) {
      beams.build(scan);
      for (const VoxelIndex& voxel : voxels)
        passes[voxel] += beams.anyPasses(geometry().voxelCentre(voxel), distance);
    }
    return passes;
  }

 private:
  /// Houses, and cars at both sides, of which each day has others.
  static Scene streetOf(int day) {
    Scene scene;
    Dice houses(1), cars(2, static_cast<std::uint64_t>(day));
    for (const double side : {-1.0, 1.0}) {
      addHouses(-20.0, 60.0, side, houses, scene.shapes);
      for (double x = -8.0; x < 55.0; x += 7.0) {
        if (cars.between(0.0, 1.0) < 0.5) addCar(x, 4.2 * side, Motion(), scene.shapes);
      }
    }
    return scene;
  }

  double end_;  ///< how far the sensor sees [m]
  std::unique_ptr<SemanticMapper> mapper_;
  std::unique_ptr<VoxelTruth> truth_;
  DriveRecord record_;
  std::vector<Scan> scans_;
  std::set<VoxelIndex> hit_, cars_;
};

struct Share {
  std::size_t count = 0, occupied = 0;
  void add(bool is_occupied) {
    ++count;
    occupied += is_occupied;
  }
  double value() const { return static_cast<double>(occupied) / static_cast<double>(count); }
};

TEST(Days, TheLastThatLookedAtAPlaceCounts) {
  const DayInTheStreet monday(1, 36.0), tuesday(2, 20.0), wednesday(3, 8.0);
  const TemporaryFolder folder;
  MergeOptions options;
  for (const auto& [name, day] :
       {std::pair("wednesday", &wednesday), std::pair("monday", &monday), std::pair("tuesday", &tuesday)}) {
    day->save(folder / name);
    options.inputs.push_back({folder / name, std::nullopt});
  }
  options.output = folder / "week.bkm";
  mergeMaps(options);
  const StoredMap week = loadMap(options.output);
  const StateRules rules = wednesday.mapper().rules(), sum = rules.withLatest(false);
  const auto occupied = [&](const VoxelIndex& voxel, const StateRules& by) {
    return viewWithoutEntropy(week.map, by, voxel).state == VoxelState::kOccupied;
  };

  Share there, there_by_sum, gone, gone_by_sum;
  for (const VoxelIndex& voxel : wednesday.cars()) {
    if (!wednesday.showsOccupied(voxel)) continue;
    there.add(occupied(voxel, rules));
    there_by_sum.add(occupied(voxel, sum));
  }
  // Follows the cars of a day. @return those of them that are out of sight of all later days.
  const auto follow = [&](const DayInTheStreet& before, const std::vector<const DayInTheStreet*>& after) {
    Share unseen;
    std::map<VoxelIndex, int> through;
    for (const DayInTheStreet* const day : after) {
      for (const auto& [voxel, scans] : day->passes(before.cars(), 0.1)) through[voxel] += scans;
    }
    for (const VoxelIndex& voxel : before.cars()) {
      bool is_near = false, is_beyond = true;
      for (const DayInTheStreet* const day : after) {
        is_near |= day->isNearCar(voxel) || day->hits(voxel);
        is_beyond &= day->isBeyond(voxel);
      }
      if (is_beyond && before.showsOccupied(voxel)) unseen.add(occupied(voxel, rules));
      if (is_near || through[voxel] < kClear) continue;
      gone.add(occupied(voxel, rules));
      gone_by_sum.add(occupied(voxel, sum));
    }
    return unseen;
  };
  const Share of_monday = follow(monday, {&tuesday, &wednesday}), of_tuesday = follow(tuesday, {&wednesday});
  std::printf(
      "[days] occupied: of what wednesday hits %.4f (by the sum %.4f), of what has gone %.4f (%.4f), of "
      "what is out of sight later: monday's %.4f, tuesday's %.4f\n",
      there.value(), there_by_sum.value(), gone.value(), gone_by_sum.value(), of_monday.value(),
      of_tuesday.value());
  ASSERT_GT(there.count, 1000u);
  ASSERT_GT(gone.count, 200u);
  ASSERT_GT(of_monday.count, 200u);
  ASSERT_GT(of_tuesday.count, 200u);
  EXPECT_GT(there.value(), 0.97) << "wednesday's cars where wednesday looked";
  EXPECT_LT(gone.value(), 0.01) << "what a later day saw to have gone";
  EXPECT_EQ(of_monday.value(), 1.0) << "where nobody has looked since";
  EXPECT_GT(of_tuesday.value(), 0.88) << "monday saw it free, and tuesday hit some of it in few scans";
  EXPECT_LT(there_by_sum.value(), 0.9) << "the sum would do as well";
  EXPECT_GT(gone_by_sum.value(), 0.1) << "the sum would do as well";
}

}  // namespace
}  // namespace bki_mapping::simulation
