// Times the parts of the mapper separately on a simulated scan. Takes the options of Google Benchmark, such
// as
// --benchmark_filter=Lines.
#include <benchmark/benchmark.h>

#include "beams/line_evidence.h"
#include "bki_mapping/io/class_table_yaml.h"
#include "bki_mapping/map/map_query.h"
#include "bki_mapping/mapping/semantic_mapper.h"
#include "io/voxel_points.h"
#include "map/view_kernels.h"
#include "mapping/scan_preprocessor.h"
#include "points/downsample.h"
#include "points/point_evidence.h"
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
  PointEvidence evidence(f.geometry, f.config.kernel, false, instruction_set);
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
  const ViewKernels& kernels = viewKernelsFor(instruction_set);
  BlockView view;
  for (auto _ : state) {
    for (const auto& [index, block] : blocks) {
      readBlock(kernels, map, *block, fields, view);
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
        benchmark::DoNotOptimize(viewVoxel(f.mapper.map(), *entry.block, v));
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
    const VoxelPoints points(f.mapper.map(), *f.classes, {{VoxelState::kOccupied, VoxelState::kFree}},
                             sortedBlocks(f.mapper.map()), f.pool);
    data.resize(points.count() * sizeof(VoxelPoint));
    points.write(reinterpret_cast<VoxelPoint*>(data.data()));
    benchmark::DoNotOptimize(data.data());
  }
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
  add("VoxelCloud", voxelCloud);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
