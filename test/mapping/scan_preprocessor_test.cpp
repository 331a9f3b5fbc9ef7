// Bad and unwanted points are skipped, and each is counted under its reason.
#include <gtest/gtest.h>

#include <limits>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "mapping/scan_preprocessor.h"
#include "reference/scenes.h"

namespace bki_mapping {
namespace {

PreprocessedScan preprocess(const Scan& scan, const MapperConfig& config) {
  ThreadPool pool(2);
  ScanPreprocessor preprocessor(config);
  return preprocessor.process(scan, *reference::smallTable(), pool);
}

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

Scan scanOf(const std::vector<Eigen::Vector3f>& points, const std::vector<std::uint32_t>& labels) {
  Scan scan;
  scan.points = points;
  scan.labels = labels;
  return scan;
}

MapperConfig plainConfig() {
  MapperConfig config;
  config.downsample_resolution = 0.0;
  return config;
}

TEST(PreprocessedScan, CountsEveryReason) {
  MapperConfig config = plainConfig();
  config.sensor_model.min_range = 0.5;
  config.sensor_model.max_range = 50.0;
  config.unlabelled_points = UnlabelledPoints::kIgnore;
  const Scan scan = scanOf(
      {{kNan, 1, 1}, {1, kInfinity, 1}, {0, 0, 0}, {0.2f, 0, 0}, {60, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}},
      {10, 10, 10, 10, 10, 10, 0, 77});
  const PreprocessedScan processed = preprocess(scan, config);
  const PointCounts& c = processed.counts;
  EXPECT_EQ(c.points, 8u);
  EXPECT_EQ(c.not_finite, 2u);
  EXPECT_EQ(c.at_sensor, 1u);
  EXPECT_EQ(c.too_near, 1u);
  EXPECT_EQ(c.beyond_max, 1u);
  EXPECT_EQ(c.unlabelled, 1u);
  EXPECT_EQ(c.unknown_label, 1u);
  EXPECT_EQ(c.labels_not_in_table, 1u);
  EXPECT_EQ(c.used, 1u);
  EXPECT_EQ(c.points, c.used + c.not_finite + c.at_sensor + c.too_near + c.beyond_max + c.outside_map +
                          c.unknown_label + c.unlabelled);
  ASSERT_EQ(processed.beams.ends.size(), 2u);  // one to the hit, and one cut at max_range
  EXPECT_NEAR(processed.beams.ends[1].x(), 50.0f, 1e-4f);
}

TEST(PreprocessedScan, PointsOfAirborneClassesOnlyClear) {
  std::vector<SemanticClass> classes = reference::smallTable()->classes();
  classes[2].airborne = true;
  const std::uint32_t snow = classes[2].raw.front(), other = classes[1].raw.front();
  ThreadPool pool(2);
  ScanPreprocessor preprocessor(plainConfig());
  const PreprocessedScan& processed =
      preprocessor.process(scanOf({{2, 0, 0}, {3, 0, 0}}, {snow, other}), ClassTable("snow", classes), pool);
  EXPECT_EQ(processed.counts.airborne, 1u);
  EXPECT_EQ(processed.counts.used, 1u);
  EXPECT_EQ(processed.hit_count, 1u);
  ASSERT_EQ(processed.beams.ends.size(), 2u) << "both beams clear";
  EXPECT_EQ(processed.beams.ends[1], Eigen::Vector3f(2, 0, 0)) << "as far as it was seen";
}

TEST(PreprocessedScan, IsolatedPointsOnlyClearUnlessTheyAreGround) {
  std::vector<SemanticClass> classes = reference::smallTable()->classes();
  const std::uint32_t plant = classes[1].raw.front();
  Scan scan;  // a wall, and something before it
  for (int row = 0; row < 8; ++row) {
    for (int column = -40; column < 40; ++column)
      scan.points.emplace_back(10.0f, 0.05f * static_cast<float>(column), 0.2f * static_cast<float>(row));
  }
  scan.points[300] *= 0.3f;
  scan.labels.assign(scan.points.size(), plant);
  const auto isolatedIn = [&](const MapperConfig& config) {
    ThreadPool pool(2);
    ScanPreprocessor preprocessor(config);
    const PreprocessedScan& processed = preprocessor.process(scan, ClassTable("plants", classes), pool);
    EXPECT_EQ(processed.beams.ends.size(), scan.points.size());
    EXPECT_EQ(processed.counts.used + processed.counts.isolated, scan.points.size());
    EXPECT_EQ(processed.hit_count, processed.counts.used);
    return processed.counts.isolated;
  };
  MapperConfig config = plainConfig();
  config.rules.enabled = true;
  EXPECT_EQ(isolatedIn(config), 0u) << "the default";
  config.rules.particles_within = 15.0;
  EXPECT_EQ(isolatedIn(config), 1u);
  config.rules.enabled = false;
  EXPECT_EQ(isolatedIn(config), 0u) << "the paper's";
  config.rules.enabled = true;
  config.rules.particles_within = 2.5;
  EXPECT_EQ(isolatedIn(config), 0u) << "it is 3 m away";
  config.rules.particles_within = 15.0;
  classes[1].ground = true;
  EXPECT_EQ(isolatedIn(config), 0u) << "no drop is ground";
}

TEST(PreprocessedScan, KnowsWithinWhichRangeHalfOfTheHitsAre) {
  Scan scan;
  for (int n = 0; n < 100; ++n) {
    scan.points.emplace_back(0.0f, n < 60 ? 4.5f : 33.0f, 0.0f);
    scan.labels.push_back(10);
  }
  const double half = preprocess(scan, plainConfig()).half_range;
  EXPECT_GT(half, 4.0);
  EXPECT_LE(half, 5.0);
  EXPECT_EQ(preprocess({}, plainConfig()).half_range, 0.0);
}

TEST(PreprocessedScan, PointsAtTheSensorsRangeAreNoReturnsWhereTheScanSaysSo) {
  MapperConfig config = plainConfig();
  config.sensor_model.max_range = 50.0;
  config.clear_beyond_max_range = false;
  Scan scan = scanOf({{50, 0, 0}, {0, 49.999f, 0}, {0, 0, 50.001f}, {49.9f, 0, 0}, {50.1f, 0, 0}},
                     {10, 10, 10, 10, 10});
  EXPECT_EQ(preprocess(scan, config).counts.used, 3u);
  scan.no_returns_at_max_range = true;
  const PreprocessedScan processed = preprocess(scan, config);
  EXPECT_EQ(processed.counts.no_returns, 3u);
  EXPECT_EQ(processed.counts.used, 1u);
  EXPECT_EQ(processed.counts.beyond_max, 1u);
  EXPECT_EQ(processed.hits.points.size(), 1u);
  EXPECT_EQ(processed.beams.ends.size(), 4u);  // three of them cut at 50 m
}

TEST(PreprocessedScan, UnlabelledIsAHitUnlessIgnored) {
  MapperConfig config = plainConfig();
  const Scan scan = scanOf({{2, 0, 0}, {0, 2, 0}}, {0, 77});
  EXPECT_EQ(preprocess(scan, config).hits.labels, std::vector<ClassId>{0});
  config.unknown_labels = UnknownLabels::kUnlabelled;
  const PreprocessedScan processed = preprocess(scan, config);
  EXPECT_EQ(processed.hits.labels, (std::vector<ClassId>{0, 0}));
  EXPECT_EQ(processed.counts.labels_not_in_table, 1u);
  EXPECT_EQ(processed.counts.unknown_label, 0u);
}

TEST(PreprocessedScan, CountsEveryOneOfEqualLabels) {
  MapperConfig config = plainConfig();
  const auto countsOf = [&](const std::vector<std::uint32_t>& labels) {
    std::vector<Eigen::Vector3f> points;
    for (std::size_t n = 0; n < labels.size(); ++n)
      points.emplace_back(2.0f + static_cast<float>(n), 0.0f, 0.0f);
    return preprocess(scanOf(points, labels), config);
  };
  EXPECT_EQ(countsOf({77, 77, 10, 10, 77, 10}).counts.unknown_label, 3u);
  EXPECT_EQ(countsOf({10, 77, 10}).hits.labels.size(), 2u);
  config.unknown_labels = UnknownLabels::kUnlabelled;
  const PreprocessedScan processed = countsOf({77, 77, 10, 0, 77, 0});
  EXPECT_EQ(processed.counts.labels_not_in_table, 3u);
  const ClassId car = processed.hits.labels[2];
  EXPECT_NE(car, 0);
  EXPECT_EQ(processed.hits.labels, (std::vector<ClassId>{0, 0, car, 0, 0, 0}));
  config.unlabelled_points = UnlabelledPoints::kIgnore;
  const PreprocessedScan fewer = countsOf({77, 77, 10, 0, 0, 10});
  EXPECT_EQ(fewer.counts.labels_not_in_table, 2u);
  EXPECT_EQ(fewer.counts.unlabelled, 4u);
  EXPECT_EQ(fewer.counts.used, 2u);
}

TEST(PreprocessedScan, LabelsMayBeIds) {
  MapperConfig config = plainConfig();
  config.label_values = LabelValues::kId;
  const Scan scan = scanOf({{2, 0, 0}, {0, 2, 0}, {0, 0, 2}, {1, 1, 1}}, {3, 10, 255, 4294967295u});
  const PreprocessedScan processed = preprocess(scan, config);
  EXPECT_EQ(processed.hits.labels, std::vector<ClassId>{3});
  EXPECT_EQ(processed.counts.unknown_label, 3u);
}

TEST(PreprocessedScan, PointsFarFromTheMapAreCounted) {
  Scan scan = scanOf({{1, 0, 0}, {1e10f, 0, 0}, {1e30f, 0, 0}}, {10, 10, 10});
  MapperConfig config = plainConfig();
  config.sensor_model.max_range = 1e11;
  SemanticMapper mapper(config, reference::smallTable());
  const PointCounts counts = mapper.integrate(scan).counts;
  EXPECT_EQ(counts.outside_map, 1u);
  EXPECT_EQ(counts.beyond_max, 1u);
  scan.origin.x() = std::numeric_limits<double>::quiet_NaN();
  const std::size_t before = mapper.map().size();
  EXPECT_THROW(mapper.integrate(scan), std::invalid_argument);
  EXPECT_EQ(mapper.map().size(), before);
}

TEST(PreprocessedScan, ACentroidAtTheSensorIsAHitWithoutABeam) {
  MapperConfig config;
  config.downsample_resolution = 0.1;
  Scan scan = scanOf({{0.01f, 0, 0}, {-0.01f, 0, 0}, {3, 0, 0}}, {10, 10, 10});
  scan.origin = {0.05, 0.05, 0.05};  // in the middle of a cell
  const PreprocessedScan processed = preprocess(scan, config);
  EXPECT_EQ(processed.hits.points.size(), 2u);
  ASSERT_EQ(processed.beams.ends.size(), 1u);
  EXPECT_FLOAT_EQ(processed.beams.ends[0].x(), 3.0f);
}

TEST(Mapper, SurvivesBeamsWhereCellsHaveNoIndex) {
  for (const char* mode : {"none", "even", "uniform", "linear"}) {
    MapperConfig config;
    config.downsample_resolution = 0.001;
    config.sensor_model.max_range = 10.0;
    config.free_space.mode = mode;
    SemanticMapper mapper(config, reference::smallTable());
    Scan scan = scanOf({{20, 0, 0}, {0, 20, 1}, {3, 0, 0}}, {10, 10, 10});
    scan.origin = {7e7, -7e7, 7e7};  // inside the map, but 7e10 cells from its origin
    const ScanStats stats = mapper.integrate(scan);
    EXPECT_EQ(stats.counts.beyond_max, 2u) << mode;
    EXPECT_EQ(stats.counts.outside_map, 1u) << mode;
  }
}

TEST(PreprocessedScan, RefusesScansWithoutOneLabelForEachPoint) {
  SemanticMapper mapper(plainConfig(), reference::smallTable());
  EXPECT_THROW(mapper.integrate(scanOf({{1, 0, 0}}, {})), std::invalid_argument);
}

TEST(Mapper, RefusesWrongSettings) {
  MapperConfig config;
  config.resolution = -1.0;
  EXPECT_THROW(SemanticMapper(config, reference::smallTable()), std::invalid_argument);
  config = MapperConfig();
  config.unknown_labels = UnknownLabels::kUnlabelled;
  std::vector<SemanticClass> one(1);
  one[0].name = "thing";
  EXPECT_THROW(SemanticMapper(config, std::make_shared<ClassTable>("one", one)), std::invalid_argument);
}

}  // namespace
}  // namespace bki_mapping
