// Units and references of the times of points: recognised where they leave no doubt, refused where they do.
#include "ros/point_times.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>

#include "cloud_maker.h"

namespace bki_mapping::ros_interface {
namespace {

using sensor_msgs::PointField;

constexpr double kNow = 1.7e9 + 0.25;

/// A cloud whose points have the times time(fraction), fraction from 0 to 1.
sensor_msgs::PointCloud2 timed(std::uint8_t datatype, const std::function<double(double)>& time,
                               double stamp = kNow, std::size_t count = 1000) {
  std::vector<double> times;
  for (std::size_t n = 0; n < count; ++n)
    times.push_back(time(static_cast<double>(n) / static_cast<double>(count - 1)));
  CloudMaker maker(std::vector<Eigen::Vector3f>(count, {3.0f, 2.0f, 1.0f}));
  maker.add("t", datatype, times);
  maker.stamp = stamp;
  return maker.message();
}

TimeReading read(const sensor_msgs::PointCloud2& cloud, TimeUnit unit = TimeUnit::kAuto,
                 TimeReference reference = TimeReference::kAuto) {
  InputConfig input;
  input.time_field = "t";
  input.time_unit = unit;
  input.time_reference = reference;
  return readingOf(timeValues(cloud, "t"), input, cloud.header.stamp);
}

std::string refusal(const sensor_msgs::PointCloud2& cloud, TimeUnit unit = TimeUnit::kAuto,
                    TimeReference reference = TimeReference::kAuto) {
  try {
    return "read " + read(cloud, unit, reference).text();
  } catch (const std::invalid_argument& fault) {
    return fault.what();
  }
}

void expectWords(const std::string& text, const std::vector<std::string>& words) {
  for (const std::string& word : words) EXPECT_NE(text.find(word), std::string::npos) << word << ": " << text;
}

TEST(PointTimes, WholeScansTellTheirUnit) {
  struct Case {
    std::uint8_t datatype;
    double last;  ///< raw time of the last point
    const char* text;
  };
  for (const Case& c : std::vector<Case>{{PointField::FLOAT32, 0.1, "in s after the stamp"},
                                         {PointField::FLOAT64, 0.05, "in s after the stamp"},
                                         {PointField::FLOAT32, 100.0, "in ms after the stamp"},
                                         {PointField::FLOAT32, 1e5, "in us after the stamp"},
                                         {PointField::FLOAT64, 1e8, "in ns after the stamp"},
                                         {PointField::UINT32, 1e8, "in ns after the stamp"},
                                         {PointField::UINT32, 99000, "in us after the stamp"},
                                         {PointField::INT32, 500, "in ms after the stamp"},
                                         {PointField::FLOAT32, -0.1, "in s after the stamp"},
                                         {PointField::INT32, -1e8, "in ns after the stamp"}}) {
    EXPECT_EQ(refusal(timed(c.datatype, [&](double f) { return c.last * f; })), std::string("read ") + c.text)
        << c.last;
  }
}

TEST(PointTimes, AbsoluteTimesAreNearTheStampWhereverItIs) {
  for (const double stamp_at : {0.0, 0.5, 1.0}) {  // start, middle and end of the scan
    for (const auto& [unit, text] : std::vector<std::pair<double, std::string>>{{1.0, "in s since 1970"},
                                                                                {1e3, "in ms since 1970"},
                                                                                {1e6, "in us since 1970"},
                                                                                {1e9, "in ns since 1970"}}) {
      const auto cloud = timed(PointField::FLOAT64,
                               [&, scale = unit](double f) { return scale * (kNow + 0.1 * (f - stamp_at)); });
      EXPECT_EQ(read(cloud).text(), text);
      const double after = read(cloud).afterStamp(unit * (kNow + 0.07), cloud.header.stamp);
      EXPECT_NEAR(after, 0.07, 1e-6) << text;
    }
  }
  // All points at one time, and points of several seconds.
  EXPECT_EQ(read(timed(PointField::FLOAT64, [](double) { return kNow; })).text(), "in s since 1970");
  const auto long_one = timed(PointField::FLOAT64, [](double f) { return kNow - 3.0 * f; });
  expectWords(refusal(long_one), {"since 1970"});
  EXPECT_EQ(read(long_one, TimeUnit::kAuto, TimeReference::kAbsolute).text(), "in s since 1970");
}

TEST(PointTimes, SimulatedTimeBeginsAtZero) {
  const auto absolute = [](double stamp) {
    return timed(
        PointField::FLOAT64, [=](double f) { return stamp + 0.1 * f; }, stamp);
  };
  const auto after = [](double stamp) {
    return timed(
        PointField::FLOAT64, [](double f) { return 0.1 * f; }, stamp);
  };
  for (const double stamp : {1.5, 5.0, 30.0, 500.0})
    EXPECT_EQ(read(absolute(stamp)).text(), "in s since 1970") << stamp;
  for (const double stamp : {0.05, 0.1, 0.5, 5.0, 500.0}) {
    EXPECT_EQ(read(after(stamp)).text(), "in s after the stamp") << stamp;
  }
  expectWords(refusal(absolute(0.5)), {"start of simulated time", "set time_reference"});
  EXPECT_EQ(read(absolute(0.5), TimeUnit::kAuto, TimeReference::kAbsolute).text(), "in s since 1970");
}

TEST(PointTimes, ACroppedCloudDoesNotChangeTheirMeaning) {
  // Ouster's nanoseconds, cut down to a few columns anywhere in the scan but its first millisecond.
  for (const double first : {1.1e6, 2e6, 5e7, 9.9e7}) {
    for (const std::size_t count : {1, 2, 20}) {
      const auto cloud = timed(
          PointField::UINT32, [&](double f) { return first + 97600.0 * (count > 1 ? f : 0.0); }, kNow,
          std::max<std::size_t>(count, 2));
      EXPECT_EQ(read(cloud).text(), "in ns after the stamp") << first;
    }
  }
  EXPECT_EQ(read(timed(PointField::UINT32, [](double) { return 0.0; })).text(), "in ns after the stamp");
  // In the first millisecond, too, although they might be microseconds of a whole scan.
  const auto two_columns = timed(PointField::UINT32, [](double f) { return 97600.0 * std::round(f); });
  EXPECT_EQ(read(two_columns).text(), "in ns after the stamp");
  EXPECT_EQ(read(two_columns, TimeUnit::kMicroseconds).text(), "in us after the stamp");
  expectWords(refusal(timed(PointField::FLOAT32, [](double f) { return 50.0 + f; })), {"set time_unit"});
}

TEST(PointTimes, TimesThatCountToTheStampOrFromElsewhere) {
  const auto falling = timed(PointField::FLOAT32, [](double f) { return 0.1 * (1.0 - f); });
  expectWords(refusal(falling), {"fall from point to point", "until_stamp"});
  const TimeReading until = read(falling, TimeUnit::kAuto, TimeReference::kUntilStamp);
  EXPECT_NEAR(until.afterStamp(0.1, ros::Time(kNow)), -0.1, 1e-9);
  EXPECT_EQ(read(falling, TimeUnit::kAuto, TimeReference::kScan).text(), "in s after the stamp");
}

TEST(PointTimes, AClockOfTheirOwn) {
  for (const auto& [datatype, unit] : std::vector<std::pair<std::uint8_t, double>>{
           {PointField::UINT32, 1e6}, {PointField::FLOAT64, 1.0}, {PointField::FLOAT64, 1e9}}) {
    const auto cloud = timed(datatype, [&, scale = unit](double f) { return scale * (3000.0 + 0.1 * f); });
    expectWords(refusal(cloud), {"time_reference (scan_end"});
    const TimeReading reading = read(cloud, TimeUnit::kAuto, TimeReference::kScanEnd);
    EXPECT_NEAR(reading.afterStamp(unit * 3000.0, cloud.header.stamp), -0.1, 1e-5);
    EXPECT_NEAR(reading.afterStamp(unit * 3000.1, cloud.header.stamp), 0.0, 1e-5);
  }
}

TEST(PointTimes, WrongClocksAndDatatypesAreNamed) {
  expectWords(refusal(timed(PointField::FLOAT64, [](double f) { return 1e9 * (kNow + 37.0 + 0.1 * f); })),
              {"ns since 1970", "37 s after the cloud's stamp", "TAI"});
  expectWords(refusal(timed(
                  PointField::FLOAT64, [](double f) { return kNow + 0.1 * f; }, 300.0)),
              {"s since 1970", "simulated time"});
  expectWords(refusal(timed(PointField::FLOAT32, [](double f) { return kNow + 0.1 * f; })),
              {"too inexactly", "FLOAT64"});
  expectWords(refusal(timed(PointField::UINT32, [](double) { return kNow; })), {"too inexactly"});
  expectWords(refusal(timed(PointField::FLOAT64, [](double f) { return 1e300 * f; })), {"time_field"});
  expectWords(refusal(timed(PointField::FLOAT32, [](double f) { return 11.0 * f; }), TimeUnit::kSeconds),
              {"do not look like times of a scan"});
}

TEST(PointTimes, AnOutlierChangesNoUnit) {
  for (const double outlier : {1e3, 1e6, 1e9}) {
    expectWords(refusal(timed(PointField::FLOAT64, [&](double f) { return f < 1.0 ? 0.1 * f : outlier; })),
                {"set time_unit"});
  }
}

TEST(PointTimes, OnlyPointsThatNeedATimeCount) {
  CloudMaker maker({{0, 0, 0}, {NAN, 1, 1}, {1, INFINITY, 1}, {5, 5, 5}, {6, 6, 6}});
  maker.add("t", PointField::FLOAT64, {0.0, 77.0, 1e300, kNow, NAN});
  maker.stamp = kNow;
  EXPECT_EQ(read(maker.message()).text(), "in s since 1970");
  const TimeValues values = timeValues(maker.message(), "t");
  EXPECT_EQ(values.low, kNow);
  EXPECT_EQ(values.high, kNow);
  CloudMaker none({{0, 0, 0}});
  none.add("t", PointField::FLOAT64, {1e300});
  EXPECT_FALSE(timeValues(none.message(), "t").any);
  EXPECT_NO_THROW(read(none.message()));
}

}  // namespace
}  // namespace bki_mapping::ros_interface
