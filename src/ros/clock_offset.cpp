#include "ros/clock_offset.h"

#include <array>
#include <cmath>

#include "bki_mapping/core/named_parameter.h"

namespace bki_mapping::ros_interface {
namespace {

constexpr double kMinute = 60.0, kHour = 3600.0, kDay = 86400.0, kYear = 365.25 * kDay;
/// TAI - UTC since 2017 [s]. GPS time is 19 s behind TAI.
constexpr double kTaiMinusUtc = 37.0, kGpsMinusUtc = 18.0;
/// From 1970 to the epoch of GPS, 6 January 1980 [s].
constexpr double kGpsEpoch = 315964800.0;
/// After 1024 weeks, old GPS receivers begin to count from 0 [s].
constexpr double kGpsRollover = 1024.0 * 7.0 * kDay;
/// No transform of this age is late, and no cloud of this age waited [s].
constexpr double kTolerance = 1.0;
/// A time before this is counted from a start, one after it from 1970 [s].
constexpr double kLongestUptime = 10.0 * kYear, kLeastDate = 30.0 * kYear;

bool near(double value, double expected, double tolerance) {
  return std::abs(value - expected) <= tolerance;
}

/// Whether a difference is a multiple of a quarter of an hour, as between time zones.
bool isTimeZone(double difference) {
  constexpr double kQuarter = kHour / 4.0;
  const double steps = std::round(difference / kQuarter);
  return steps >= 1.0 && difference <= 14.0 * kHour + kTolerance &&
         near(difference, steps * kQuarter, 2.0 * kTolerance);
}

}  // namespace

std::string durationText(double seconds) {
  struct Unit {
    double length;
    const char* name;
  };
  if (seconds < 1.0) return numberText(std::round(1e3 * seconds)) + " ms";
  for (const Unit& unit :
       std::array<Unit, 4>{{{kYear, "years"}, {kDay, "days"}, {kHour, "h"}, {kMinute, "min"}}}) {
    if (seconds >= 2.0 * unit.length || (unit.length == kHour && seconds >= kHour)) {
      return numberText(std::round(10.0 * seconds / unit.length) / 10.0) + " " + unit.name;
    }
  }
  return numberText(std::round(10.0 * seconds) / 10.0) + " s";
}

std::string clockAdvice(const ros::Time& stamp, const ros::Time& tf) {
  const double ahead = stamp.toSec() - tf.toSec(), difference = std::abs(ahead);
  const std::string whose = ahead > 0.0 ? "the sensor" : "the publisher of the transforms";
  if (stamp.toSec() < kLongestUptime && tf.toSec() > kLeastDate) {
    return ", which looks like time since the sensor's start instead of since 1970; synchronise the sensor's "
           "clock (PTP, GPS), or have its driver stamp clouds with the computer's time";
  }
  if (tf.toSec() < kLongestUptime && stamp.toSec() > kLeastDate) {
    return ", which looks like simulated time in tf and real time in the clouds; set use_sim_time before all "
           "nodes start, or nowhere";
  }
  if (near(difference, kTaiMinusUtc, kTolerance)) {
    return ", which looks like TAI, as PTP counts it, instead of UTC; give " + whose +
           " the UTC offset of 37 s, or have the driver stamp with the computer's time";
  }
  if (near(difference, kGpsMinusUtc, kTolerance)) {
    return ", which looks like GPS time instead of UTC; have " + whose +
           " subtract the leap seconds (18 s), or have the driver stamp with the computer's time";
  }
  if (near(difference, kGpsEpoch, kMinute)) {
    return ", which looks like seconds since 1980, as GPS counts them, instead of since 1970; have the "
           "driver "
           "stamp with the computer's time";
  }
  if (difference >= kGpsRollover / 2.0 && near(std::remainder(difference, kGpsRollover), 0.0, kMinute)) {
    return ", which looks like a GPS receiver whose weeks have run over; update it, or have the driver stamp "
           "with the computer's time";
  }
  if (isTimeZone(difference)) {
    return ", which looks like local time instead of UTC; set the clock of " + whose + " to UTC";
  }
  if (difference >= kDay) {
    return ", which looks like a recording together with live data; play it with --clock, and set "
           "use_sim_time before all nodes start";
  }
  return "; synchronise the clocks of the sensor and the computers (PTP, NTP), or have the driver stamp with "
         "the computer's time";
}

}  // namespace bki_mapping::ros_interface
