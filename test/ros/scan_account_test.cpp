// Every cloud is accounted for: queue, ledger, diagnostics and time jumps.
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <stdexcept>

#include "ros/load_advice.h"
#include "ros/mapping_diagnostics.h"
#include "ros/point_account.h"
#include "ros/point_field.h"
#include "ros/publisher_set.h"
#include "ros/scan_ledger.h"
#include "ros/scan_queue.h"
#include "ros/sentence_throttle.h"
#include "ros/time_watch.h"

namespace bki_mapping::ros_interface {
namespace {

using Clock = ScanLedger::Clock;
using diagnostic_msgs::DiagnosticStatus;
using std::chrono::milliseconds;

TEST(RollingStatistics, KnowsTheLastValues) {
  RollingStatistics values(4);
  EXPECT_EQ(values.median(), 0.0);
  for (const double x : {100.0, 1.0, 3.0, 2.0, 4.0}) values.add(x);
  EXPECT_EQ(values.median(), 2.0);
  EXPECT_EQ(values.quantile(0.99), 4.0);
  EXPECT_EQ(values.quantile(0.0), 1.0);
}

TEST(RateMeter, CountsTheLastSeconds) {
  RateMeter rate(2.0);
  const Clock::time_point start;
  EXPECT_EQ(rate.rate(start), 0.0);
  for (int i = 0; i < 100; ++i) rate.tick(start + milliseconds(100 * i));
  EXPECT_NEAR(rate.rate(start + milliseconds(9900)), 10.0, 0.6);
  EXPECT_EQ(rate.rate(start + milliseconds(20000)), 0.0);
}

WaitingCloud numbered(std::size_t number) {
  return {nullptr, number, {}};
}

TEST(ScanQueue, GivesUpTheOldestOrTheNewest) {
  ScanQueue queue;
  for (const std::size_t n : {0u, 1u}) EXPECT_FALSE(queue.push(numbered(n), 2, QueuePolicy::kDropOldest));
  EXPECT_EQ(queue.push(numbered(2), 2, QueuePolicy::kDropOldest)->input, 0u);
  EXPECT_EQ(queue.push(numbered(3), 2, QueuePolicy::kDropNewest)->input, 3u);
  EXPECT_EQ(queue.size(), 2u);
  EXPECT_FALSE(queue.takeIf([](const WaitingCloud&) { return false; }));
  // A cloud that must wait does not block later ones.
  EXPECT_EQ(queue.takeIf([](const WaitingCloud& w) { return w.input == 2; })->input, 2u);
  EXPECT_EQ(queue.takeIf([](const WaitingCloud&) { return true; })->input, 1u);
  EXPECT_EQ(queue.size(), 0u);
}

TEST(ScanLedger, AddsUp) {
  ScanLedger ledger;
  const Clock::time_point now;
  std_msgs::Header header;
  ScanStats stats;
  stats.counts.points = 10;
  stats.counts.used = 6;
  stats.counts.no_returns = 3;
  stats.update_ms = 20.0;
  const std::size_t clouds = 1 + dropKinds().size() + 3;  // integrated, dropped, waiting
  for (std::size_t i = 0; i < clouds; ++i) ledger.received(now);
  ledger.integrated(header, stats, 0.25, now);
  EXPECT_EQ(ledger.status(now, 3).points_received, 10u);
  EXPECT_EQ(ledger.status(now, 3).points_used, 6u);
  EXPECT_EQ(ledger.status(now, 3).points_no_returns, 3u);
  EXPECT_EQ(ledger.status(now, 3).latency_median_ms, 250.0f);
  EXPECT_EQ(ledger.status(now, 3).integration_p99_ms, 20.0f);
  for (const DropKind& kind : dropKinds()) {
    EXPECT_EQ(&kind - dropKinds().data(), static_cast<std::ptrdiff_t>(kind.reason));
    const std::uint64_t before = ledger.status(now, 3).*kind.count;
    ledger.dropped(header, kind.reason, "set this or that");
    EXPECT_EQ(ledger.status(now, 3).*kind.count, before + 1);
    EXPECT_EQ(ledger.status(now, 3).last_drop, "set this or that");
    EXPECT_EQ(ledger.status(now, 3).last_drop_reason, kind.name);
    EXPECT_FALSE(ledger.status(now, 3).integrated_last);
  }
  EXPECT_EQ(ledger.droppedClouds(), dropKinds().size());
  EXPECT_EQ(ledger.status(now, 3).waiting, 3u);
  EXPECT_EQ(ledger.status(now, 3).received, clouds);
  const std::string text = ledger.summary(3);
  EXPECT_NE(text.find("Mapped 1 of " + std::to_string(clouds) + " clouds"), std::string::npos) << text;
  EXPECT_NE(text.find("1 queue full"), std::string::npos) << text;
  EXPECT_NE(text.find("3 were still waiting"), std::string::npos) << text;
  EXPECT_NE(text.find("used 6 of 10 points"), std::string::npos) << text;
}

TEST(ScanLedger, CountsEveryKindOfPoint) {
  ScanStats stats;
  PointCounts& counts = stats.counts;
  counts.used = 1;
  counts.no_returns = 2;
  counts.points = 3;
  std::size_t n = 3;
  for (const PointKind& kind : pointKinds()) counts.points += counts.*kind.in_scan = n++;
  // Covers all reasons: one that is not in the table would be missing from the sum.
  EXPECT_EQ(counts.points, counts.used + counts.not_finite + counts.at_sensor + counts.too_near +
                               counts.beyond_max + counts.outside_map + counts.unknown_label +
                               counts.unlabelled + counts.airborne + counts.isolated + counts.no_direction +
                               counts.no_returns);
  ScanLedger ledger;
  for (int i = 0; i < 2; ++i) ledger.integrated({}, stats, 0.0, {});
  const MappingStatus status = ledger.status({}, 0);
  EXPECT_EQ(status.points_received, 2 * counts.points);
  for (const PointKind& kind : pointKinds()) {
    EXPECT_EQ(status.*kind.in_status, 2 * counts.*kind.in_scan) << kind.name;
  }
}

TEST(ScanLedger, TellsTheWeatherOfTheLastCloud) {
  ScanLedger ledger;
  EXPECT_EQ(ledger.status({}, 0).weather_particles, 0.0f);
  ScanStats stats;
  stats.counts.points = 200;
  stats.counts.used = 120;
  stats.counts.airborne = 10;
  stats.counts.isolated = 20;
  stats.counts.no_returns = 40;
  stats.counts.no_direction = 10;
  stats.half_range = 12.5;
  ledger.integrated({}, stats, 0.0, {});
  const MappingStatus status = ledger.status({}, 0);
  EXPECT_FLOAT_EQ(status.weather_particles, 0.2f);
  EXPECT_FLOAT_EQ(status.weather_no_returns, 0.25f);
  EXPECT_FLOAT_EQ(status.weather_half_range, 12.5f);
}

TEST(Diagnostics, TellOfTheWeather) {
  MappingStatus before, now;
  now.received = now.integrated = 1;
  now.blocks = 1;
  now.weather_half_range = 12.4f;
  now.weather_particles = 0.03f;
  now.weather_no_returns = 0.6f;
  EXPECT_EQ(judge(before, now, {}).message, "mapping");
  now.weather_particles = 0.2f;
  Health health = judge(before, now, {});
  EXPECT_EQ(health.level, diagnostic_msgs::DiagnosticStatus::WARN);
  EXPECT_EQ(
      health.message,
      "20 % of the returns are rain, snow, fog or dust, and half of the others are within 12 m; slow down");
  now.weather_particles = 0.0f;
  now.weather_no_returns = 0.9f;
  health = judge(before, now, {});
  EXPECT_EQ(health.level, diagnostic_msgs::DiagnosticStatus::WARN);
  EXPECT_EQ(health.message,
            "90 % of the beams return nothing; clean the lidar, or slow down in fog and rain");
}

UnlistedLabels unlisted(const std::map<std::int64_t, std::size_t>& counts) {
  UnlistedLabels labels;
  for (const auto& [label, points] : counts) labels.add(label, points);
  return labels;
}

TEST(ScanLedger, TellsUnknownLabelsApart) {
  ScanLedger ledger;
  ledger.unlistedLabels(unlisted({{-1, 4}, {7, 2}, {300, 1}}));
  ledger.unlistedLabels(unlisted({{7, 3}}));
  UnlistedLabels none;
  none.addMissing();
  ledger.unlistedLabels(none);
  const MappingStatus status = ledger.status(Clock::time_point(), 0);
  EXPECT_EQ(status.unknown_labels, (std::vector<std::int64_t>{-1, 7, 300}));
  EXPECT_EQ(status.unknown_label_counts, (std::vector<std::uint64_t>{4, 5, 1}));
  EXPECT_EQ(status.labels_missing, 1u);
  UnlistedLabels many;
  for (std::int64_t label = 1000; label < 2000; ++label) many.add(label);
  ledger.unlistedLabels(many);
  EXPECT_EQ(ledger.status(Clock::time_point(), 0).unknown_labels.size(), 64u);
}

TEST(SentenceThrottle, RepeatsNoSentenceWhateverItsNumbers) {
  SentenceThrottle throttle;
  const Clock::time_point start;
  EXPECT_TRUE(throttle.allow("/front: the cloud has no field 'label'", start));
  EXPECT_TRUE(throttle.allow("/rear: the cloud has no field 'class'", start)) << "another fault";
  EXPECT_FALSE(throttle.allow("/front: the cloud has no field 'label'", start + milliseconds(4900)));
  EXPECT_TRUE(throttle.allow("/front: the cloud has no field 'label'", start + milliseconds(5000)));
  EXPECT_TRUE(throttle.allow("the latest transform is 35 ms older", start));
  EXPECT_FALSE(throttle.allow("the latest transform is -1.5 ms older", start));
}

TEST(SentenceThrottle, IsBounded) {
  SentenceThrottle throttle;
  const Clock::time_point start;
  std::size_t allowed = 0;
  for (int second = 0; second < 100; ++second) {
    for (char a = 'a'; a <= 'z'; ++a) {
      for (char b = 'a'; b <= 'z'; ++b) {
        allowed +=
            throttle.allow(std::string("no frame '") + a + b + "'", start + std::chrono::seconds(second));
      }
    }
  }
  EXPECT_LE(allowed, 100 / 5 * SentenceThrottle::kMax);
  EXPECT_GE(allowed, 100 / 5 * SentenceThrottle::kMax / 2);
}

TEST(Diagnostics, JudgeWhatHappened) {
  const MapperConfig config;
  MappingStatus before, now;
  EXPECT_EQ(judge(before, now, config).level, DiagnosticStatus::WARN);  // no cloud received yet
  now.received = 10;
  now.integrated = 10;
  EXPECT_EQ(judge(before, now, config).level, DiagnosticStatus::OK);
  before = now;
  EXPECT_EQ(judge(before, now, config).level, DiagnosticStatus::WARN);  // no more clouds received
  now.received = 20;
  now.integrated = 15;
  now.dropped_queue_full = 5;
  EXPECT_EQ(judge(before, now, config).level, DiagnosticStatus::WARN);
  EXPECT_NE(judge(before, now, config).message.find("5 queue full"), std::string::npos);
  now.integrated = 10;
  now.dropped_no_transform = 5;
  EXPECT_EQ(judge(before, now, config).level, DiagnosticStatus::ERROR);
  now = before;
  now.received = now.integrated = 20;
  now.received_hz = 10.0f;
  now.integration_median_ms = 250.0f;
  EXPECT_EQ(judge(before, now, config).level, DiagnosticStatus::WARN);
  now.paused = true;
  EXPECT_NE(judge(before, now, config).message.find("~resume"), std::string::npos);
}

/// The health for 40 clouds of 1000 points: the given numbers are left out by reason, the others are used.
Health verdict(const std::vector<std::pair<std::size_t PointCounts::*, std::size_t>>& kinds,
               const UnlistedLabels& labels = {}, const InputConfig& input = {}) {
  PointCounts counts;
  counts.points = counts.used = 1000;
  for (const auto& [kind, count] : kinds) {
    counts.*kind += count;
    counts.used -= count;
  }
  PointAccount account;
  account.label_remedy = "do this or that";
  for (int i = 0; i < 40; ++i) account.add(counts, labels);
  return judgePoints(account, "/points", input, MapperConfig(), "semantic_kitti");
}

TEST(Points, ThatAreOfNoUseAreNamedWithTheRemedy) {
  using C = PointCounts;
  const auto expect = [](const Health& health, std::uint8_t level, const std::vector<std::string>& all) {
    EXPECT_EQ(health.level, level) << health.message;
    for (const std::string& words : all) {
      EXPECT_NE(health.message.find(words), std::string::npos) << words << " is not in: " << health.message;
    }
  };
  constexpr auto kWarn = DiagnosticStatus::WARN, kError = DiagnosticStatus::ERROR;
  expect(verdict({{&C::unknown_label, 1000}}, unlisted({{3, 10}, {7777, 990}})), kError,
         {"none of the points of the last 40 clouds of /points is used", "100 % have labels",
          "class table 'semantic_kitti' does not list (7777 most often)", "do this or that"});
  expect(verdict({{&C::unknown_label, 950}}, unlisted({{7777, 950}})), kWarn,
         {"only 5 %", "95 % have labels"});
  UnlistedLabels none;
  for (int i = 0; i < 1000; ++i) none.addMissing();
  expect(verdict({{&C::unknown_label, 1000}}, none), kError, {"have no label", "label_field"});
  // Train ids for raw labels: what is used is wrong, too.
  expect(verdict({{&C::unknown_label, 730}}, unlisted({{9, 730}})), kWarn,
         {"only 27 %", "73 % have labels", "(9 most often); do this or that"});
  expect(verdict({{&C::not_finite, 600}, {&C::unknown_label, 50}}, unlisted({{-1, 50}})), kWarn,
         {"only 35 %", "5 % have labels", "(-1 most often)"});
  InputConfig colors;
  colors.label_encoding = LabelEncoding::kRgb;
  expect(verdict({{&C::unknown_label, 1000}}, unlisted({{0x0100ff, 1000}}), colors), kError,
         {"0x0100ff", "do this or that"});
  expect(verdict({{&C::not_finite, 1000}}), kWarn, {"100 % are NaN or infinite", "clear_no_returns"});
  expect(verdict({{&C::at_sensor, 1000}}), kWarn, {"within 1 mm of the sensor", "clear_no_returns"});
  expect(verdict({{&C::no_direction, 1000}}), kWarn, {"direction is not known", "organised clouds"});
  InputConfig ranges;
  ranges.sensor_model = {2.0, 5.0};
  MapperConfig mapper;
  mapper.sensor_model = ranges.sensor_model;
  PointAccount near;
  near.add({1000, 0, 0, 0, 1000}, {});
  expect(judgePoints(near, "/points", ranges, mapper, ""), kError,
         {"of the last cloud of", "nearer than sensor_model/min_range 2 m"});
  expect(judgePoints(near, "/points", ranges, MapperConfig(), ""), kError, {"the input's min_range 2 m"});
  expect(verdict({{&C::too_near, 950}}), kWarn, {"95 % are nearer than"});
  expect(verdict({{&C::beyond_max, 1000}}), kWarn, {"are beyond", "in metres"});
  expect(verdict({{&C::outside_map, 1000}}), kError, {"too far from the map's origin"});
  expect(verdict({{&C::unlabelled, 1000}}), kWarn, {"unlabelled_points"});
  // A fault is reported even if a usual reason has more points.
  expect(verdict({{&C::not_finite, 600}, {&C::unknown_label, 400}}, unlisted({{7777, 400}})), kError,
         {"40 % have labels"});
}

TEST(Points, OfHealthySensorsAreNotWarnedOf) {
  using C = PointCounts;
  const auto expectHealthy = [](const Health& health) {
    EXPECT_EQ(health.level, DiagnosticStatus::OK) << health.message;
    EXPECT_EQ(health.message, "");
  };
  expectHealthy(verdict({}));
  expectHealthy(verdict({{&C::not_finite, 600}}));                         // an organised cloud outdoors
  expectHealthy(verdict({{&C::not_finite, 990}}));                         // a drone that sees a mast
  expectHealthy(verdict({{&C::no_returns, 1000}}));                        // only sky, which is cleared
  expectHealthy(verdict({{&C::no_returns, 997}, {&C::no_direction, 3}}));  // plus columns without any return
  expectHealthy(verdict({{&C::no_direction, 600}}));                       // rings that see only sky
  expectHealthy(verdict({{&C::no_returns, 999}, {&C::unknown_label, 1}}));
  expectHealthy(verdict({{&C::at_sensor, 950}}));
  expectHealthy(verdict({{&C::beyond_max, 990}}));  // a short max_range outdoors
  expectHealthy(verdict({{&C::unlabelled, 950}}));  // a user who maps only cars
  expectHealthy(verdict({{&C::too_near, 500}, {&C::unknown_label, 40}}));
  expectHealthy(judgePoints({}, "/points", {}, {}, ""));
}

TEST(Diagnostics, TellOfPointsBesideTheRest) {
  MappingStatus before, now;
  now.received = now.integrated = 10;
  now.blocks = 5;
  const Health points{DiagnosticStatus::ERROR, "none of the points is used"};
  EXPECT_EQ(judge(before, now, {}, points).level, DiagnosticStatus::ERROR);
  now.dropped_empty = 3;
  const Health both = judge(before, now, {}, points);
  EXPECT_EQ(both.level, DiagnosticStatus::ERROR);
  EXPECT_EQ(both.message, "none of the points is used; dropped: 3 empty");
  // Points are used, but the map stays empty.
  now.dropped_empty = 0;
  now.blocks = 0;
  now.points_used = 7;
  EXPECT_EQ(judge(before, now, {}).level, DiagnosticStatus::OK) << "it may have been reset";
  before = now;
  now.received = now.integrated = 20;
  now.points_used = 20;
  EXPECT_EQ(judge(before, now, {}).level, DiagnosticStatus::WARN);
  EXPECT_NE(judge(before, now, {}).message.find("the map is empty, though 13 points"), std::string::npos);
}

TEST(PublisherSet, ATopicTakesATenthOfTheTimeAtMost) {
  using Seconds = std::chrono::duration<double>;
  EXPECT_DOUBLE_EQ(publishPeriod(2.0, Seconds(0.01)).count(), 0.5);
  EXPECT_DOUBLE_EQ(publishPeriod(2.0, Seconds(0.05)).count(), 0.5);
  EXPECT_DOUBLE_EQ(publishPeriod(2.0, Seconds(0.2)).count(), 2.0);
  EXPECT_DOUBLE_EQ(publishPeriod(50.0, Seconds(0.2)).count(), 2.0);
}

TEST(LoadAdvice, SaysHowFarBehindAndWhatWouldHelp) {
  MapperConfig config;
  EXPECT_EQ(loadAdvice(config, 50.0, 10.0), "");
  EXPECT_EQ(loadAdvice(config, 50.0, 0.0), "");
  const std::string text = loadAdvice(config, 240.0, 10.0);
  for (const char* words :
       {"240 ms", "every 100 ms", "2.4 times too slow",
        "resolution 0.6, kernel/length 0.6 and downsample_resolution 0.2 would take about 96 ms",
        "free_space/extent mapped about ", "linear with one sample a beam about ",
        "sensor_model/max_range"}) {
    EXPECT_NE(text.find(words), std::string::npos) << words << " is not in: " << text;
  }
  config.free_space.mode = "none";
  EXPECT_EQ(loadAdvice(config, 240.0, 10.0).find("free_space"), std::string::npos);
}

std::string document(const std::string& name) {
  std::ifstream in(BKI_MAPPING_SOURCE_DIR "/docs/" + name);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

/// The cells of the table's row that begins with `first`, in the text after `heading`.
std::vector<std::string> rowOf(const std::string& text, const std::string& heading,
                               const std::string& first) {
  const std::size_t row = text.find("\n| " + first + " |", text.find(heading));
  std::vector<std::string> cells;
  if (row == std::string::npos) return cells;
  std::istringstream line(text.substr(row + 3, text.find('\n', row + 1) - row - 3));
  for (std::string cell; std::getline(line, cell, '|');) {
    const std::size_t begin = cell.find_first_not_of(' ');
    if (begin != std::string::npos)
      cells.push_back(cell.substr(begin, cell.find_last_not_of(' ') + 1 - begin));
  }
  return cells;
}

/// The median time of a mode on SemanticKITTI 04 with two threads [ms].
double documentedMedian(const std::string& mode) {
  const auto cells = rowOf(document("performance.md"), "## SemanticKITTI 04", mode + " | 0.3 | 2");
  if (cells.size() < 4) throw std::runtime_error("docs/performance.md has no row of " + mode);
  return std::stod(cells[3]);
}

FreeSpaceConfig freeSpace(const std::string& mode, int samples = 1,
                          FreeSpaceExtent extent = FreeSpaceExtent::kObserved) {
  FreeSpaceConfig config;
  config.mode = mode;
  config.samples_per_beam = samples;
  config.extent = extent;
  return config;
}

TEST(LoadAdvice, EstimatesWhatTheDocumentsSay) {
  const std::string tuning = document("tuning.md");
  const auto coarser = rowOf(tuning, "## It is slow",
                             "`resolution`, `kernel/length` and "
                             "`downsample_resolution` twice as coarse");
  const auto nearer = rowOf(tuning, "## It is slow", "`sensor_model/max_range` 30");
  ASSERT_EQ(coarser.size(), 5u);
  ASSERT_EQ(nearer.size(), 5u);
  const double linear = documentedMedian("linear, 1 sample"),
               mapped = documentedMedian("line, bilinear, mapped");
  struct Row {
    std::string name;
    FreeSpaceConfig free_space;
    std::size_t column;  // index in the table of docs/tuning.md
  };
  for (const Row& row :
       std::vector<Row>{{"none", freeSpace("none"), 1},
                        {"linear, 1 sample", freeSpace("linear"), 2},
                        {"linear, 5 samples", freeSpace("linear", 5), 2},
                        {"uniform, 1 sample", freeSpace("uniform"), 2},
                        {"even, gap 1 m", freeSpace("even"), 2},
                        {"line, bilinear, mapped", freeSpace("line", 1, FreeSpaceExtent::kMapped), 3},
                        {"line, bilinear, observed", freeSpace("line"), 4}}) {
    MapperConfig config;
    config.free_space = row.free_space;
    config.sensor_model.max_range = 60.0;
    const double median = documentedMedian(row.name), now = 100.0 * median;
    const std::string text = loadAdvice(config, now, 10.0);
    // The time that follows the given words in the text [ms], or -1.
    const auto estimate = [&](const std::string& words) {
      const std::size_t at = text.find(words);
      return at == std::string::npos ? -1.0 : std::stod(text.substr(at + words.size()));
    };
    const auto expectAbout = [&](double fraction, const std::string& cell) {
      const std::size_t to = cell.find(" to ");
      const double low = std::stod(cell),
                   high = to == std::string::npos ? low : std::stod(cell.substr(to + 4));
      EXPECT_GE(fraction, low - 0.006) << row.name << ", " << cell;
      EXPECT_LE(fraction, high + 0.006) << row.name << ", " << cell;
    };
    EXPECT_NEAR(estimate("one sample a beam about "), median > linear ? 100.0 * linear : -1.0, 1.0) << text;
    const bool observed = row.name.find("observed") != std::string::npos;
    EXPECT_NEAR(estimate("extent mapped about "), observed ? 100.0 * mapped : -1.0, 1.0) << text;
    expectAbout(estimate("would take about ") / now, coarser[row.column]);
    expectAbout(estimate("max_range 30 about ") / now, nearer[row.column]);
  }
}

TEST(TimeWatch, WaitsAreMeasuredInWallTime) {
  EXPECT_DOUBLE_EQ(secondsSince(ros::Time(100.0), ros::Time(100.25), false), 0.25);
  EXPECT_EQ(secondsSince(ros::Time(100.0), ros::Time(99.0), false), 0.0);  // the system's clock was set
  EXPECT_EQ(secondsSince(ros::Time(100.0), ros::Time(10000.0), false), 60.0);
  // A replay's first /clock comes after its first cloud: nobody has waited for a transform for 1000 s.
  EXPECT_EQ(secondsSince(ros::Time(0.0), ros::Time(1000.0), true), 0.0);
}

TEST(TimeWatch, NoticesTimeGoingBack) {
  TimeWatch watch;
  EXPECT_FALSE(watch.clockWentBack(ros::Time(10.0)));
  EXPECT_FALSE(watch.clockWentBack(ros::Time(10.0)));
  EXPECT_TRUE(watch.clockWentBack(ros::Time(9.9)));
  EXPECT_FALSE(watch.clockWentBack(ros::Time(9.95)));

  EXPECT_FALSE(watch.stampsWentBack(0, ros::Time(100.0)));
  EXPECT_FALSE(watch.stampsWentBack(1, ros::Time(50.0)));  // clock of another sensor
  EXPECT_FALSE(watch.stampsWentBack(0, ros::Time(99.5)));  // out of order
  EXPECT_FALSE(watch.stampsWentBack(0, ros::Time()));
  EXPECT_FALSE(watch.stampsWentBack(0, ros::Time(20.0)));  // a single outlier
  EXPECT_FALSE(watch.stampsWentBack(0, ros::Time(100.1)));
  EXPECT_FALSE(watch.stampsWentBack(0, ros::Time(98.0)));
  EXPECT_TRUE(watch.stampsWentBack(0, ros::Time(98.1)));
  EXPECT_FALSE(watch.stampsWentBack(0, ros::Time(98.2)));
  EXPECT_FALSE(watch.stampsWentBack(0, ros::Time(4294967295u, 0u)));
  watch.restart();
  EXPECT_FALSE(watch.stampsWentBack(0, ros::Time(1.0)));
}

/// The indices, in a sequence of stamps of one input [s], at which a time jump is detected. The watch then
/// restarts, as in the server.
std::vector<std::size_t> jumpsIn(const std::vector<double>& stamps) {
  TimeWatch watch;
  std::vector<std::size_t> jumps;
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    if (!watch.stampsWentBack(0, ros::Time(stamps[i]))) continue;
    jumps.push_back(i);
    watch.restart();
  }
  return jumps;
}

TEST(TimeWatch, AJumpTakesTwoCloudsThatAgree) {
  using Indices = std::vector<std::size_t>;
  EXPECT_EQ(jumpsIn({100, 100.1, 150, 100.2, 100.3, 100.4}), Indices{}) << "one outlier far ahead";
  EXPECT_EQ(jumpsIn({100, 100.1, 105, 100.2, 100.3, 100.4}), Indices{}) << "one a little ahead";
  EXPECT_EQ(jumpsIn({150, 100, 100.1, 100.2}), Indices{}) << "the very first is one";
  EXPECT_EQ(jumpsIn({100, 100.1, 150, 130, 100.2, 100.3}), Indices{}) << "two ahead that do not agree";
  EXPECT_EQ(jumpsIn({100, 100.1, 130, 150, 100.2, 100.3}), Indices{}) << "the same, the nearer one first";
  EXPECT_EQ(jumpsIn({100, 100.1, 150, 100.2, 150.1, 100.3, 100.4}), Indices{}) << "two ahead, one at a time";
  EXPECT_EQ(jumpsIn({100, 100.1, 50, 100.2, 100.3}), Indices{}) << "one outlier behind";
  EXPECT_EQ(jumpsIn({100, 100.1, 50, 20, 100.2, 100.3}), Indices{}) << "two behind that do not agree";
  EXPECT_EQ(jumpsIn({100, 100.1, 99.5, 99.6, 100.2}), Indices{}) << "out of order by less than a second";
  EXPECT_EQ(jumpsIn({100, 100.1, 160, 160.1, 160.2}), Indices{}) << "a pause";
  EXPECT_EQ(jumpsIn({100, 100.1, 20, 20.1, 20.2}), Indices{3}) << "a bag that starts again";
  EXPECT_EQ(jumpsIn({100, 100.1, 20, 20.1, 20.2, 100, 100.1, 20, 20.1}), (Indices{3, 8})) << "twice";
  EXPECT_EQ(jumpsIn({100, 102, 104, 20, 22, 24}), Indices{4}) << "the same with a slow sensor";
  EXPECT_EQ(jumpsIn({100, 0, 100.1, 0, 20, 0, 20.1}), Indices{6}) << "stamps of 0 in between say nothing";
  EXPECT_EQ(jumpsIn({100, 100.1, 0, 150, 0, 100.2, 0, 100.3}), Indices{}) << "nor do they confirm an outlier";
}

TEST(TimeWatch, EachInputHasItsOwnTime) {
  TimeWatch watch;
  for (int i = 0; i < 20; ++i) {
    const double t = 0.1 * i;
    EXPECT_FALSE(watch.stampsWentBack(0, ros::Time(100.0 + t)));
    EXPECT_FALSE(watch.stampsWentBack(1, ros::Time(50.0 + t))) << "its clock is 50 s behind";
    EXPECT_FALSE(watch.stampsWentBack(2, ros::Time(i % 5 == 0 ? 500.0 + t : 100.0 + t))) << "strays";
  }
  EXPECT_FALSE(watch.stampsWentBack(1, ros::Time(20.0)));
  EXPECT_FALSE(watch.stampsWentBack(0, ros::Time(102.0)));
  EXPECT_TRUE(watch.stampsWentBack(1, ros::Time(20.1)));
}

}  // namespace
}  // namespace bki_mapping::ros_interface
