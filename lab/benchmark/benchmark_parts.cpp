// Times the parts of the mapper separately on a simulated scan. Takes the options of Google Benchmark, such
// as
// --benchmark_filter=Lines.
#include <benchmark/benchmark.h>

#include <algorithm>

#include "beams/line_evidence.h"
#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/query/distance_field.h"
#include "bki_mapping/query/queries.h"
#include "bki_mapping/rules/voxel_state.h"
#include "bki_mapping/settings/yaml.h"
#include "export/voxel_points.h"
#include "mapping/scan_preprocessor.h"
#include "parallel/counter_random.h"
#include "points/downsample.h"
#include "points/point_evidence.h"
#include "rules/state_kernels.h"
#include "simd/instruction_sets.h"
#include "simulation/lidar.h"
#include "update/map_updater.h"

namespace {

using namespace bki_mapping;

/// A scan of 64 beams, the same after preprocessing, and a map of it.
struct Fixture {
  Fixture() : pool(1), preprocessor(config), mapper(config, classes) {
    seen = preprocessor.process(scan, *classes, pool);
    mapper.integrate(scan);
  }

  MapperConfig config;
  GridGeometry geometry{config.resolution};
  std::shared_ptr<const ClassTable> classes =
      std::make_shared<const ClassTable>(loadClassTable("semantic_kitti"));
  Scan scan = simulation::Drive({5, 8.0, 1, {}}).frame(4).scan();
  ThreadPool pool;
  ScanPreprocessor preprocessor;
  PreprocessedScan seen;
  SemanticMapper mapper;
};

Fixture& fixture() {
  static Fixture instance;
  return instance;
}

void observing(benchmark::State& state) {
  Fixture& f = fixture();
  for (auto _ : state) benchmark::DoNotOptimize(&f.preprocessor.process(f.scan, *f.classes, f.pool));
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(f.scan.points.size()));
}

void binning(benchmark::State& state) {
  Fixture& f = fixture();
  PointEvidence evidence(f.geometry, f.config.kernel);
  for (auto _ : state) evidence.setPoints(f.scan.origin, f.preprocessor.hitGroups(), f.pool);
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(f.seen.hits.points.size()));
}

void hits(benchmark::State& state, const std::string& instruction_set) {
  Fixture& f = fixture();
  PointEvidence evidence(f.geometry, f.config.kernel, false, {}, instruction_set);
  evidence.setPoints(f.scan.origin, f.preprocessor.hitGroups(), f.pool);
  SemanticMap map(f.geometry, f.config.prior, f.classes->size());
  MapUpdater updater;
  for (auto _ : state) updater.update(map, {&evidence}, f.pool);
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(f.seen.hits.points.size()));
}

void beamField(benchmark::State& state, BeamIndexType index) {
  Fixture& f = fixture();
  BeamField field(f.geometry, f.config.kernel, index);
  for (auto _ : state) field.setBeams(f.seen.beams, f.pool);
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(f.seen.beams.ends.size()));
}

/// Queries the beams near each block of the map.
void retrieval(benchmark::State& state, BeamIndexType index) {
  Fixture& f = fixture();
  BeamField field(f.geometry, f.config.kernel, index);
  field.setBeams(f.seen.beams, f.pool);
  NearBeams near;
  for (auto _ : state) {
    for (const auto& entry : f.mapper.map().entries()) {
      field.findRangesNear(entry.index, near);
      benchmark::DoNotOptimize(near.ranges.data());
    }
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(f.mapper.map().size()));
}

void lines(benchmark::State& state, BeamIndexType index, const std::string& instruction_set) {
  Fixture& f = fixture();
  BeamField field(f.geometry, f.config.kernel, index);
  field.setBeams(f.seen.beams, f.pool);
  LineEvidence evidence(BeamWeight::kBilinear, FreeSpaceExtent::kObserved, instruction_set);
  evidence.setField(field, f.pool);
  SemanticMap map(f.geometry, f.config.prior, f.classes->size());
  MapUpdater updater;
  for (auto _ : state) updater.update(map, {nullptr, &evidence}, f.pool);
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(f.seen.beams.ends.size()));
}

/// A map of 64 blocks of five planes, four classes and `free`, which stays in a core's caches.
SemanticMap mapOfFivePlanes() {
  Fixture& f = fixture();
  SemanticMap map(f.geometry, f.config.prior, f.classes->size());
  std::vector<EvidenceUnits> plane(kBlockVoxels);
  std::uint32_t n = 1;
  for (int x = 0; x < 64; ++x) {
    for (const ClassId id : {ClassId{0}, ClassId{3}, ClassId{8}, ClassId{11}, kFreeClass}) {
      for (EvidenceUnits& units : plane) {
        n = n * 1664525u + 1013904223u;
        units = n >> 31 == 0 ? 0 : static_cast<EvidenceUnits>(n >> 12);
      }
      map.getOrAllocate({{x, 0, 0}}).add(id, plane.data());
    }
  }
  return map;
}

/// Reads whole blocks. Prints the time of a block.
void readBlocks(benchmark::State& state, const std::string& instruction_set, BlockFields fields) {
  const SemanticMap map = mapOfFivePlanes();
  const auto blocks = sortedBlocks(map);
  const StateKernels& kernels = stateKernelsFor(instruction_set);
  const StateRules rules;
  BlockView view;
  for (auto _ : state) {
    for (const auto& [index, block] : blocks) {
      readBlock(kernels, map, rules, index, *block, fields, view);
      benchmark::DoNotOptimize(&view);
    }
  }
  using benchmark::Counter;
  state.counters["block"] =
      Counter(static_cast<double>(blocks.size()), Counter::kIsIterationInvariantRate | Counter::kInvert);
}

/// A snapshot of 50,000 blocks, 64 in each region of the map, as in a street.
void snapshots(benchmark::State& state) {
  SemanticMap map(GridGeometry(0.3), 0.001, 3);
  constexpr int kBlocks = 50000, kWidth = 10 * Region::kEdge;
  for (int n = 0; n < kBlocks; ++n) map.getOrAllocate({{n / kWidth, n % kWidth, 0}});
  for (auto _ : state) benchmark::DoNotOptimize(map.snapshot());
}

/// State, class and probability of every voxel of the map.
void queries(benchmark::State& state) {
  Fixture& f = fixture();
  std::int64_t voxels = 0;
  for (auto _ : state) {
    for (const auto& entry : f.mapper.map().entries()) {
      for (int v = 0; v < kBlockVoxels; ++v) {
        benchmark::DoNotOptimize(viewVoxel(f.mapper.map(), f.mapper.rules(), entry.index, *entry.block, v));
        ++voxels;
      }
    }
  }
  state.SetItemsProcessed(voxels);
}

/// The cloud of the topic voxel_cloud.
void voxelCloud(benchmark::State& state) {
  Fixture& f = fixture();
  std::vector<std::uint8_t> data;
  for (auto _ : state) {
    const VoxelPoints points(f.mapper.map(), f.mapper.rules(), *f.classes,
                             {{VoxelState::kOccupied, VoxelState::kFree}}, sortedBlocks(f.mapper.map()),
                             f.pool);
    data.resize(points.count() * sizeof(VoxelPoint));
    points.write(reinterpret_cast<VoxelPoint*>(data.data()), Eigen::Vector3d::Zero());
    benchmark::DoNotOptimize(data.data());
  }
}

/// A map of ten scans of a drive, and random places around it.
struct QueryFixture {
  QueryFixture() : mapper(MapperConfig(), fixture().classes) {
    const simulation::Drive drive({10, 8.0, 1, {}});
    for (std::size_t n = 0; n < drive.size(); ++n) mapper.integrate(drive.frame(n).scan());
    middle = drive.frame(5).scan().origin;
    std::uint64_t drawn = 0;
    const auto within = [&drawn](double reach) {
      return reach * (2.0 * counterRandom(1, 0, 0, drawn++) - 1.0);
    };
    for (std::size_t n = 0; n < 200000; ++n) {
      points.emplace_back(middle + Eigen::Vector3d(within(40.0), within(20.0), within(2.0)));
      const Eigen::Vector3d from = middle + Eigen::Vector3d(within(10.0), within(3.0), within(0.5));
      rays.push_back({from, {within(1.0), within(1.0), within(0.2)}, 20.0});
    }
    for (std::size_t n = 0; n < 2000; ++n) {
      poses.emplace_back(Eigen::Translation3d(points[n]) *
                         Eigen::AngleAxisd(within(3.1), Eigen::Vector3d::UnitZ()));
    }
  }
  Eigen::AlignedBox3d region(double x, double y, double z) const {
    const Eigen::Vector3d half(0.5 * x, 0.5 * y, 0.5 * z);
    return {middle - half, middle + half};
  }

  SemanticMapper mapper;
  Eigen::Vector3d middle;
  std::vector<Eigen::Vector3d> points;
  std::vector<Ray> rays;
  std::vector<Eigen::Isometry3d> poses;
};

QueryFixture& queryFixture() {
  static QueryFixture instance;
  return instance;
}

/// Decides all blocks of the map, one after the other.
void decideStates(benchmark::State& state) {
  const SemanticMap& map = queryFixture().mapper.map();
  for (auto _ : state) {
    const StateMap states(map, queryFixture().mapper.rules(), 1);
    for (const auto& entry : map.entries()) benchmark::DoNotOptimize(states.find(entry.index));
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(map.size()));
}

/// What the snapshot after a scan takes over from the one before, of which all was decided and searched.
void takingOver(benchmark::State& state) {
  QueryFixture& f = queryFixture();
  const MapSnapshot before = f.mapper.snapshot();
  const Scan scan = simulation::Drive({11, 8.0, 1, {}}).frame(10).scan();
  f.mapper.integrate(scan);
  const MapSnapshot after = f.mapper.snapshot();
  f.mapper.withdraw(scan);
  const StateMap states(before, 1);
  frontiers(states);
  for (auto _ : state) {
    const StateMap next(after, states, 1);
    benchmark::DoNotOptimize(&next);
  }
}

/// @param query called as query(const StateMap&); answers `items`.
template <typename Query>
void ask(benchmark::State& state, int threads, std::size_t items, Query&& query) {
  const StateMap states(queryFixture().mapper.map(), queryFixture().mapper.rules(), threads);
  for (auto _ : state) query(states);
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(items));
}

void readingPoints(benchmark::State& state, int threads, bool posterior, bool sorted) {
  std::vector<Eigen::Vector3d> points = queryFixture().points;
  const GridGeometry& geometry = queryFixture().mapper.map().geometry();
  const auto blockOf = [&](const Eigen::Vector3d& p) { return GridGeometry::blockOf(geometry.voxelAt(p)); };
  if (sorted) {
    std::sort(points.begin(), points.end(),
              [&](const auto& a, const auto& b) { return blockOf(a) < blockOf(b); });
  }
  std::vector<VoxelState> found(points.size());
  std::vector<float> occupancy(points.size()), variance(points.size());
  PointValues values;
  values.states = found.data();
  if (posterior) values.occupancy = occupancy.data();
  if (posterior) values.variance = variance.data();
  ask(state, threads, points.size(), [&](const StateMap& states) { readPoints(states, points, values); });
}

/// The states of points from the evidence of each, without a StateMap.
void readingEachPoint(benchmark::State& state) {
  const QueryFixture& f = queryFixture();
  for (auto _ : state) {
    for (const Eigen::Vector3d& point : f.points) {
      benchmark::DoNotOptimize(
          viewWithoutEntropy(f.mapper.map(), f.mapper.rules(), f.mapper.map().geometry().voxelAt(point)));
    }
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(f.points.size()));
}

void castingRays(benchmark::State& state, int threads, const RayStops& stops) {
  const std::vector<Ray>& rays = queryFixture().rays;
  std::vector<RayHit> hits(rays.size());
  ask(state, threads, rays.size(), [&](const StateMap& states) { castRays(states, rays, stops, hits); });
}

/// The footprint of a car at random poses.
void footprints(benchmark::State& state, int threads) {
  const auto& poses = queryFixture().poses;
  std::vector<SpaceContent> contents(poses.size());
  const OrientedBox car = {Eigen::Isometry3d::Identity(), {2.5, 1.0, 0.75}};
  ask(state, threads, poses.size(),
      [&](const StateMap& states) { contentsAlong(states, car, poses, contents); });
}

void findingNearest(benchmark::State& state) {
  const auto& points = queryFixture().points;
  constexpr std::size_t kPoints = 2000;
  ask(state, 1, kPoints, [&](const StateMap& states) {
    for (std::size_t n = 0; n < kPoints; ++n) benchmark::DoNotOptimize(nearestObstacle(states, points[n]));
  });
}

/// 100 m x 100 m.
void sections(benchmark::State& state, int threads) {
  const QueryFixture& f = queryFixture();
  const Eigen::Vector2d middle = f.middle.head<2>(), half(50.0, 50.0);
  ask(state, threads, 1, [&](const StateMap& states) {
    benchmark::DoNotOptimize(horizontalSection(states, f.middle.z(), {middle - half, middle + half}));
  });
}

/// The first search of a map whose states are decided.
void findingFrontiersFirst(benchmark::State& state, int threads) {
  const SemanticMap& map = queryFixture().mapper.map();
  for (auto _ : state) {
    state.PauseTiming();
    auto states = std::make_unique<StateMap>(map, queryFixture().mapper.rules(), threads);
    for (const auto& entry : map.entries()) states->find(entry.index);
    state.ResumeTiming();
    benchmark::DoNotOptimize(frontiers(*states, {1, false, std::nullopt}));
    state.PauseTiming();
    states = nullptr;
    state.ResumeTiming();
  }
}

/// Further searches, for which the frontiers of each region have been kept.
void findingFrontiers(benchmark::State& state, int threads, const FrontierRules& rules) {
  ask(state, threads, 1, [&](const StateMap& states) { benchmark::DoNotOptimize(frontiers(states, rules)); });
}

/// A region of 100 m x 100 m x 10 m.
void distances(benchmark::State& state, int threads, const ObstacleRules& rules) {
  const Eigen::AlignedBox3d region = queryFixture().region(100.0, 100.0, 10.0);
  ask(state, threads, 1,
      [&](const StateMap& states) { benchmark::DoNotOptimize(DistanceField(states, region, rules)); });
}

/// An update of that where the next scan has changed the map.
void updatingDistances(benchmark::State& state, int threads) {
  QueryFixture& f = queryFixture();
  const MapSnapshot before = f.mapper.snapshot();
  const Scan scan = simulation::Drive({11, 8.0, 1, {}}).frame(10).scan();
  f.mapper.integrate(scan);
  const std::vector<GridIndex> changed = f.mapper.touchedBlocks();
  const MapSnapshot after = f.mapper.snapshot();
  f.mapper.withdraw(scan);
  const StateMap old_states(before, threads), new_states(after, threads);
  DistanceField field(old_states, f.region(100.0, 100.0, 10.0));
  for (auto _ : state) {
    field.update(new_states, changed);
    field.update(old_states, changed);
  }
  state.SetItemsProcessed(2 * state.iterations());
}

}  // namespace

int main(int argc, char** argv) {
  const auto add = [](const std::string& name, auto&& body) {
    benchmark::RegisterBenchmark(name.c_str(), body)->Unit(benchmark::kMillisecond);
  };
  add("Observe", observing);
  add("Bin", binning);
  add("BeamTable", [](auto& state) { beamField(state, BeamIndexType::kTable); });
  add("BeamRtree", [](auto& state) { beamField(state, BeamIndexType::kRtree); });
  add("RetrieveFromTable", [](auto& state) { retrieval(state, BeamIndexType::kTable); });
  add("RetrieveFromRtree", [](auto& state) { retrieval(state, BeamIndexType::kRtree); });
  for (const std::string& set : instructionSets()) {
    add("Hits/" + set, [set](auto& state) { hits(state, set); });
    add("LinesFromTable/" + set, [set](auto& state) { lines(state, BeamIndexType::kTable, set); });
    add("ReadStates/" + set, [set](auto& state) { readBlocks(state, set, BlockFields::kStates); });
    add("ReadBlock/" + set, [set](auto& state) { readBlocks(state, set, BlockFields::kAllButEntropy); });
    add("ReadBlockWithEntropy/" + set, [set](auto& state) { readBlocks(state, set, BlockFields::kAll); });
  }
  add("LinesFromRtree", [](auto& state) { lines(state, BeamIndexType::kRtree, ""); });
  add("Snapshot", snapshots);
  add("Query", queries);
  add("DecideStates", decideStates);
  add("TakeOverStates", takingOver);
  add("PointsOneByOne", readingEachPoint);
  for (const int threads : {1, 2}) {
    const std::string on = "/threads:" + std::to_string(threads);
    const auto addOn = [&](const std::string& name, auto&& body) {
      benchmark::RegisterBenchmark((name + on).c_str(), body)->Unit(benchmark::kMillisecond)->UseRealTime();
    };
    addOn("PointStates", [=](auto& state) { readingPoints(state, threads, false, false); });
    addOn("PointStatesSorted", [=](auto& state) { readingPoints(state, threads, false, true); });
    addOn("PointPosteriors", [=](auto& state) { readingPoints(state, threads, true, false); });
    addOn("PointPosteriorsSorted", [=](auto& state) { readingPoints(state, threads, true, true); });
    addOn("Rays", [=](auto& state) { castingRays(state, threads, {}); });
    addOn("RaysToUnknown", [=](auto& state) { castingRays(state, threads, {ClassFilter::all(), true}); });
    addOn("Footprints", [=](auto& state) { footprints(state, threads); });
    addOn("Section", [=](auto& state) { sections(state, threads); });
    addOn("FrontierSizesFirst", [=](auto& state) { findingFrontiersFirst(state, threads); });
    addOn("Frontiers", [=](auto& state) { findingFrontiers(state, threads, {}); });
    addOn("FrontierSizes", [=](auto& state) { findingFrontiers(state, threads, {1, false, std::nullopt}); });
    addOn("FrontierSizesInBox", [=](auto& state) {
      findingFrontiers(state, threads, {1, false, queryFixture().region(30.0, 30.0, 10.0)});
    });
    addOn("DistanceField", [=](auto& state) { distances(state, threads, {}); });
    addOn("DistanceFieldUnknown", [=](auto& state) {
      distances(state, threads, {ClassFilter::all(), true});
    });
    addOn("DistanceUpdate", [=](auto& state) { updatingDistances(state, threads); });
  }
  add("NearestObstacle", findingNearest);
  add("VoxelCloud", voxelCloud);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
