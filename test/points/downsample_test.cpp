// Down-sampling equals the reference for every tile size and number of threads; the majority rule.
#include <gtest/gtest.h>

#include "points/downsample.h"
#include "reference/reference.h"
#include "reference/scenes.h"
#include "simd/instruction_sets.h"

namespace bki_mapping {
namespace {

LabelledPoints downsample(const Eigen::Vector3d& origin, const LabelledPoints& input, double cell,
                          int threads = 2, double tile = 2.4, const std::string& instruction_set = "") {
  ThreadPool pool(threads);
  Downsampler downsampler(cell, tile, instruction_set);
  LabelledPoints output;
  for (int time = 0; time < 2; ++time) {  // the second time reuses the memory of the first
    const std::size_t chunks = 3;
    downsampler.start(origin, chunks, pool, true);
    const std::size_t chunk_size = input.points.size() / chunks + 1;
    pool.forEach(chunks, [&](std::size_t c, std::size_t worker) {
      Downsampler::Input& into = downsampler.open(c, worker);
      for (std::size_t i = c * chunk_size; i < std::min(input.points.size(), (c + 1) * chunk_size); ++i) {
        into.add(input.points[i], input.labels[i]);
      }
      downsampler.close(c, worker);
    });
    downsampler.finish(pool);
    downsampler.inOrder(pool, output);
  }
  return output;
}

TEST(Downsample, EqualsReferenceOnNastyScenes) {
  for (const reference::Scene& scene : reference::nastyScenes(500)) {
    LabelledPoints input;
    std::vector<reference::Point> points;
    for (std::size_t i = 0; i < scene.scan.points.size(); ++i) {
      input.points.push_back(scene.scan.points[i]);
      input.labels.push_back(static_cast<ClassId>(scene.scan.labels[i] / 10));
      points.push_back({scene.scan.points[i].cast<double>(), input.labels.back()});
    }
    const auto slow = reference::downsample(scene.scan.origin, points, 0.4);
    EXPECT_LT(slow.size(), points.size()) << scene.name;
    // Tiles that are a multiple of the cell, that are not, of one cell, and too large for one tile.
    for (const double tile : {2.4, 0.7, 0.1, 16.0}) {
      for (const std::string& set : instructionSets()) {
        const LabelledPoints fast = downsample(scene.scan.origin, input, 0.4, 2, tile, set);
        ASSERT_EQ(fast.points.size(), slow.size()) << scene.name << ", tile " << tile;
        for (std::size_t i = 0; i < slow.size(); ++i) {
          EXPECT_LT((fast.points[i].cast<double>() - slow[i].p).norm(), 1e-6)
              << scene.name << ", tile " << tile;
          EXPECT_EQ(fast.labels[i], slow[i].label) << scene.name << ", tile " << tile;
        }
      }
    }
  }
}

TEST(Downsample, ThreadCountChangesNoBit) {
  const reference::Scene scene = reference::nastyScenes(2000).front();
  LabelledPoints input{scene.scan.points, {}};
  for (std::size_t i = 0; i < input.points.size(); ++i) input.labels.push_back(static_cast<ClassId>(i % 3));
  const LabelledPoints one = downsample(scene.scan.origin, input, 0.4, 1);
  for (const int threads : {2, 5}) {
    const LabelledPoints several = downsample(scene.scan.origin, input, 0.4, threads);
    EXPECT_EQ(one.points, several.points) << threads;  // to the bit
    EXPECT_EQ(one.labels, several.labels) << threads;
  }
}

TEST(Downsample, MajorityAndTies) {
  LabelledPoints input;
  for (const int label : {3, 1, 1, 2, 2, 3, 3}) {
    input.points.emplace_back(0.5f, 0.5f, 0.5f);
    input.labels.push_back(static_cast<ClassId>(label));
  }
  EXPECT_EQ(downsample({0, 0, 0}, input, 1.0).labels, std::vector<ClassId>{3});
  input.points.pop_back();
  input.labels.pop_back();
  EXPECT_EQ(downsample({0, 0, 0}, input, 1.0).labels, std::vector<ClassId>{1});  // 1, 2 and 3 have two each
}

TEST(Downsample, ZeroTurnsItOff) {
  LabelledPoints input{{{0, 0, 0}, {0, 0, 0}}, {1, 1}};
  EXPECT_EQ(downsample({0, 0, 0}, input, 0.0).points.size(), 2u);
}

}  // namespace
}  // namespace bki_mapping
