// Every cloud is accounted for: the queue, the ledger, the judgement on them, and time jumps.
#include <gtest/gtest.h>

#include "bki_mapping/ros/load_advice.h"
#include "bki_mapping/ros/map_publishing.h"
#include "bki_mapping/ros/mapping_diagnostics.h"
#include "bki_mapping/ros/scan_ledger.h"
#include "bki_mapping/ros/scan_queue.h"
#include "bki_mapping/ros/time_watch.h"

namespace bki_mapping::ros_shell {
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
  // One that must wait does not hold up those behind it.
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
  for (int i = 0; i < 14; ++i) ledger.received(now);
  ledger.integrated(header, stats, 0.25, now);
  EXPECT_EQ(ledger.status(now, 3).points_dropped, 1u);
  EXPECT_EQ(ledger.status(now, 3).latency_median_ms, 250.0f);
  EXPECT_EQ(ledger.status(now, 3).integration_p99_ms, 20.0f);
  for (const DropKind& kind : dropKinds()) {
    EXPECT_EQ(&kind - dropKinds().data(), static_cast<std::ptrdiff_t>(kind.reason));
    const std::uint64_t before = ledger.status(now, 3).*kind.count;
    ledger.dropped(header, kind.reason);
    EXPECT_EQ(ledger.status(now, 3).*kind.count, before + 1);
    EXPECT_EQ(ledger.status(now, 3).last_drop, kind.name);
    EXPECT_FALSE(ledger.status(now, 3).integrated_last);
  }
  EXPECT_EQ(ledger.droppedClouds(), dropKinds().size());
  EXPECT_EQ(ledger.status(now, 3).waiting, 3u);
  EXPECT_EQ(ledger.status(now, 3).received, 1 + dropKinds().size() + 3);
  const std::string text = ledger.summary(3);
  EXPECT_NE(text.find("Mapped 1 of 14 clouds"), std::string::npos) << text;
  EXPECT_NE(text.find("1 queue full"), std::string::npos) << text;
  EXPECT_NE(text.find("3 were still waiting"), std::string::npos) << text;
}

TEST(ScanLedger, TellsUnknownLabelsApart) {
  ScanLedger ledger;
  ledger.unknownLabels({{7, 2}, {300, 1}});
  ledger.unknownLabels({{7, 3}});
  const MappingStatus status = ledger.status(Clock::time_point(), 0);
  EXPECT_EQ(status.unknown_labels, (std::vector<std::uint32_t>{7, 300}));
  EXPECT_EQ(status.unknown_label_counts, (std::vector<std::uint64_t>{5, 1}));
  std::map<std::uint32_t, std::size_t> many;
  for (std::uint32_t label = 1000; label < 2000; ++label) many[label] = 1;
  ledger.unknownLabels(many);
  EXPECT_EQ(ledger.status(Clock::time_point(), 0).unknown_labels.size(), 64u);
}

TEST(Diagnostics, JudgeWhatHappened) {
  const MapperConfig config;
  MappingStatus before, now;
  EXPECT_EQ(judge(before, now, config).level, DiagnosticStatus::WARN);  // no cloud yet
  now.received = 10;
  now.integrated = 10;
  EXPECT_EQ(judge(before, now, config).level, DiagnosticStatus::OK);
  before = now;
  EXPECT_EQ(judge(before, now, config).level, DiagnosticStatus::WARN);  // none comes any more
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

TEST(MapPublishing, ATopicTakesATenthOfTheTimeAtMost) {
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
        "resolution 0.6, kernel/length 0.6 and downsample_resolution 0.2 would take about 101 ms",
        "free_space/extent mapped about 158 ms", "linear with one sample a beam about 58 ms",
        "sensor_model/max_range"}) {
    EXPECT_NE(text.find(words), std::string::npos) << words << " is not in: " << text;
  }
  config.free_space.mode = "none";
  EXPECT_EQ(loadAdvice(config, 240.0, 10.0).find("free_space"), std::string::npos);
}

TEST(TimeWatch, NoticesTimeGoingBack) {
  TimeWatch watch;
  EXPECT_FALSE(watch.clockWentBack(ros::Time(10.0)));
  EXPECT_FALSE(watch.clockWentBack(ros::Time(10.0)));
  EXPECT_TRUE(watch.clockWentBack(ros::Time(9.9)));
  EXPECT_FALSE(watch.clockWentBack(ros::Time(9.95)));

  EXPECT_FALSE(watch.stampsWentBack(0, ros::Time(100.0)));
  EXPECT_FALSE(watch.stampsWentBack(1, ros::Time(50.0)));  // another sensor's clock
  EXPECT_FALSE(watch.stampsWentBack(0, ros::Time(99.5)));  // out of order
  EXPECT_FALSE(watch.stampsWentBack(0, ros::Time()));
  EXPECT_FALSE(watch.stampsWentBack(0, ros::Time(20.0)));  // a stray
  EXPECT_FALSE(watch.stampsWentBack(0, ros::Time(100.1)));
  EXPECT_FALSE(watch.stampsWentBack(0, ros::Time(98.0)));
  EXPECT_TRUE(watch.stampsWentBack(0, ros::Time(98.1)));
  EXPECT_FALSE(watch.stampsWentBack(0, ros::Time(98.2)));
  EXPECT_FALSE(watch.stampsWentBack(0, ros::Time(4294967295u, 0u)));
  watch.restart();
  EXPECT_FALSE(watch.stampsWentBack(0, ros::Time(1.0)));
}

}  // namespace
}  // namespace bki_mapping::ros_shell
