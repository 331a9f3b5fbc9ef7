// Down-sampling against its slow reference, and the majority rule.
#include <gtest/gtest.h>

#include "bki_mapping/inference/downsample.h"
#include "reference/reference.h"
#include "reference/scenes.h"

namespace bki_mapping {
namespace {

LabelledPoints downsample(const Eigen::Vector3d& origin, const LabelledPoints& input, double cell,
                          int threads = 2) {
  Workers workers(threads);
  Downsampler downsampler;
  LabelledPoints output;
  for (int time = 0; time < 2; ++time) {  // the second time with the memory of the first
    const std::size_t chunks = 3;
    downsampler.start(origin, cell, chunks);
    for (std::size_t i = 0; i < input.points.size(); ++i) {
      downsampler.add(i * chunks / input.points.size(), input.points[i], input.labels[i]);
    }
    downsampler.finish(workers, output);
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
    const LabelledPoints fast = downsample(scene.scan.origin, input, 0.4);
    const auto slow = reference::downsample(scene.scan.origin, points, 0.4);
    ASSERT_EQ(fast.points.size(), slow.size()) << scene.name;
    EXPECT_LT(slow.size(), points.size()) << scene.name;
    for (std::size_t i = 0; i < slow.size(); ++i) {
      EXPECT_LT((fast.points[i].cast<double>() - slow[i].p).norm(), 1e-6) << scene.name;
      EXPECT_EQ(fast.labels[i], slow[i].label) << scene.name;
    }
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
