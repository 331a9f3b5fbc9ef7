// What a difference between the clocks of clouds and tf looks like, in the words of a remedy.
#include "ros/clock_offset.h"

#include <gtest/gtest.h>

#include <vector>

namespace bki_mapping::ros_interface {
namespace {

constexpr double kNow = 1.7e9;

TEST(ClockOffset, IsNamedByItsSize) {
  struct Case {
    double stamp, tf;
    const char* words;
  };
  constexpr double kGpsEpoch = 315964800.0, kRollover = 619315200.0;
  for (const Case& c : std::vector<Case>{
           {kNow + 37.3, kNow,
            "TAI, as PTP counts it, instead of UTC; give the sensor the UTC offset of 37 s"},
           {kNow + 36.1, kNow, "TAI"},
           {kNow - 37.0, kNow, "give the publisher of the transforms the UTC offset"},
           {kNow + 18.4, kNow, "GPS time instead of UTC"},
           {kNow - 17.8, kNow, "GPS time"},
           {kNow + 39.0, kNow, "; synchronise the clocks"},
           {kNow + 5.0, kNow, "; synchronise the clocks"},
           {300.0, kNow, "time since the sensor's start"},
           {kNow, 300.0, "simulated time in tf"},
           {kNow - kGpsEpoch + 18.0, kNow, "seconds since 1980"},
           {kNow - kRollover, kNow, "weeks have run over"},
           {kNow + 2 * 3600.0, kNow, "local time instead of UTC; set the clock of the sensor to UTC"},
           {kNow - 5.75 * 3600.0, kNow, "local time"},
           {kNow - 5.85 * 3600.0, kNow, "; synchronise the clocks"},
           {kNow - 30 * 86400.0, kNow, "a recording together with live data"}}) {
    const std::string advice = clockAdvice(ros::Time(c.stamp), ros::Time(c.tf));
    EXPECT_NE(advice.find(c.words), std::string::npos) << c.stamp - c.tf << ": " << advice;
  }
}

TEST(ClockOffset, IsSaidInAUnitForPeople) {
  EXPECT_EQ(durationText(0.35), "350 ms");
  EXPECT_EQ(durationText(37.04), "37 s");
  EXPECT_EQ(durationText(119.0), "119 s");
  EXPECT_EQ(durationText(600.0), "10 min");
  EXPECT_EQ(durationText(3600.2), "1 h");
  EXPECT_EQ(durationText(5.0 * 86400.0), "5 days");
  EXPECT_EQ(durationText(1.7e9), "53.9 years");
}

}  // namespace
}  // namespace bki_mapping::ros_interface
