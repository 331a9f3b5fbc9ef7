#include "ros/point_times.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <unordered_set>
#include <vector>

#include "bki_mapping/core/named_parameter.h"
#include "ros/clock_offset.h"
#include "ros/point_field.h"

namespace bki_mapping::ros_interface {
namespace {

/// Durations of a scan [s]: lidars turn at 1 to 50 Hz.
constexpr double kShortestScan = 0.02, kLongestTurn = 1.0;
/// Times that differ by less than this need no decision: all points of such a slice share a pose [s].
constexpr double kNoMatter = 1e-3;
/// So many points have times that fall, and none one that rises, before that is no accident.
constexpr std::size_t kManyFalls = 100;
/// The mean of the times of a scan is at least this fraction of their range from its ends; that of times with
/// few far outliers is nearer.
constexpr double kFarFromEnds = 0.05;
/// Stamps of 2001 to 2100 [s]: numbers between these, in one unit, are times since 1970.
constexpr double kFirstDate = 1e9, kLastDate = 4.1e9;
/// Numbers that are dates farther from the stamp than this count something else [s].
constexpr double kSameYear = 3.2e7;

struct Unit {
  TimeUnit unit;
  double seconds;
  const char* name;
};
/// All units, from the longest on.
constexpr std::array<Unit, 4> kUnits = {{{TimeUnit::kSeconds, 1.0, "s"},
                                         {TimeUnit::kMilliseconds, 1e-3, "ms"},
                                         {TimeUnit::kMicroseconds, 1e-6, "us"},
                                         {TimeUnit::kNanoseconds, 1e-9, "ns"}}};

const Unit& factsOf(TimeUnit unit) {
  return *std::find_if(kUnits.begin(), kUnits.end(), [&](const Unit& u) { return u.unit == unit; });
}

/// The times in a message, such as "the times in field 't' (0 to 99000)".
std::string timesText(const TimeValues& values, const InputConfig& input) {
  return "the times in field '" + input.time_field + "' (" + numberText(values.low) + " to " +
         numberText(values.high) + ")";
}

/// The units that the settings allow.
std::vector<Unit> allowedUnits(const InputConfig& input) {
  std::vector<Unit> units;
  for (const Unit& unit : kUnits) {
    if (input.time_unit == TimeUnit::kAuto || input.time_unit == unit.unit) units.push_back(unit);
  }
  return units;
}

/// Whether the field holds times in this unit since 1970 to a millisecond.
bool holdsDates(const TimeValues& values, const Unit& unit) {
  if (values.integer) return unit.seconds <= kNoMatter;
  constexpr double kHalfUlp = 0x1p-24;
  return !values.single || kHalfUlp * std::abs(values.high) * unit.seconds <= kNoMatter;
}

/// The unit in which all times are at most `near` from the stamp, and at most `longest` from each other [s].
std::optional<Unit> absoluteUnit(const TimeValues& values, const std::vector<Unit>& units, double stamp,
                                 double near, double longest) {
  for (const Unit& unit : units) {
    const double low = unit.seconds * values.low, high = unit.seconds * values.high;
    const bool fits =
        std::abs(low - stamp) <= near && std::abs(high - stamp) <= near && high - low <= longest;
    if (fits && holdsDates(values, unit)) return unit;
  }
  return std::nullopt;
}

/// Why times are no times of this scan, with the remedy.
std::string noTimes(const TimeValues& values, const InputConfig& input, const ros::Time& stamp) {
  for (const Unit& unit : allowedUnits(input)) {
    const double date = unit.seconds * values.low;
    if (date < kFirstDate || date > kLastDate) continue;
    if (stamp.toSec() > kFirstDate && std::abs(date - stamp.toSec()) > kSameYear) continue;
    if (!holdsDates(values, unit)) {
      return timesText(values, input) + " are " + unit.name +
             " since 1970, which their datatype holds too inexactly; have the driver publish FLOAT64, or set "
             "time_field to another field or empty";
    }
    const double ahead = date - stamp.toSec();
    return timesText(values, input) + " are " + unit.name + " since 1970, " + durationText(std::abs(ahead)) +
           (ahead > 0.0 ? " after" : " before") + " the cloud's stamp" + clockAdvice(ros::Time(date), stamp);
  }
  return timesText(values, input) +
         " do not look like times of a scan at the stamp of the cloud; set time_unit and time_reference "
         "(scan_end if they count on a clock of their own), or time_field to another field or empty";
}

/// The unit of times that count from or to the stamp, so that the longest is `largest` raw.
Unit offsetUnit(const TimeValues& values, const InputConfig& input, double largest, const ros::Time& stamp) {
  const Unit& usual = factsOf(values.integer ? TimeUnit::kNanoseconds : TimeUnit::kSeconds);
  const bool usual_fits = usual.seconds * largest <= kLongestScan;
  for (const Unit& unit : kUnits) {
    // Units differ by a factor of 1000, so at most one of them fits.
    const double longest = unit.seconds * largest;
    if (longest <= kNoMatter || longest > kLongestTurn || unit.unit == usual.unit) continue;
    if (values.integer && unit.unit == TimeUnit::kSeconds) continue;
    if (values.spread && unit.seconds * (values.high - values.low) >= kShortestScan) return unit;
    break;  // too few or too close to prove another unit than the usual one
  }
  if (!usual_fits) throw std::invalid_argument(noTimes(values, input, stamp));
  return usual;
}

}  // namespace

TimeValues timeValues(const sensor_msgs::PointCloud2& cloud, const std::string& field) {
  checkSizes(cloud);
  const FieldReader x(cloud, "x"), y(cloud, "y"), z(cloud, "z"), time(cloud, field);
  TimeValues values;
  values.integer = time.integer();
  values.single = time.single();
  std::unordered_set<double> different;
  std::size_t falls = 0, rises = 0, count = 0;
  double before = 0.0, sum = 0.0;
  for (std::size_t row = 0; row < cloud.height; ++row) {
    for (std::size_t column = 0; column < cloud.width; ++column) {
      const std::uint8_t* bytes = cloud.data.data() + row * cloud.row_step + column * cloud.point_step;
      const double raw = time(bytes);
      if (!std::isfinite(raw)) continue;
      if (!needsTime(
              {static_cast<float>(x(bytes)), static_cast<float>(y(bytes)), static_cast<float>(z(bytes))}))
        continue;
      if (values.any && raw < before) ++falls;
      if (values.any && raw > before) ++rises;
      if ((!values.any || raw != before) && different.size() < TimeValues::kManyTimes) different.insert(raw);
      values.low = values.any ? std::min(values.low, raw) : raw;
      values.high = values.any ? std::max(values.high, raw) : raw;
      values.any = true;
      before = raw;
      sum += raw;
      ++count;
    }
  }
  const double range = values.high - values.low, margin = kFarFromEnds * range;
  const double above = count > 0 ? sum / static_cast<double>(count) - values.low : 0.0;
  values.spread = different.size() >= TimeValues::kManyTimes && above > margin && above < range - margin;
  values.falling = rises == 0 && falls >= kManyFalls;
  return values;
}

double TimeReading::afterStamp(double raw, const ros::Time& stamp) const {
  const double unit_seconds = factsOf(unit).seconds;
  switch (reference) {
    case TimeReference::kScanEnd:
      return unit_seconds * (raw - latest);
    case TimeReference::kUntilStamp:
      return -unit_seconds * raw;
    case TimeReference::kAbsolute:
      return unit_seconds * raw - stamp.toSec();
    default:
      return unit_seconds * raw;
  }
}

std::string TimeReading::text() const {
  const std::string in = std::string("in ") + factsOf(unit).name;
  switch (reference) {
    case TimeReference::kScanEnd:
      return in + ", the last point having the stamp";
    case TimeReference::kUntilStamp:
      return in + " before the stamp";
    case TimeReference::kAbsolute:
      return in + " since 1970";
    default:
      return in + " after the stamp";
  }
}

TimeReading readingOf(const TimeValues& values, const InputConfig& input, const ros::Time& stamp) {
  TimeReading reading{
      input.time_unit == TimeUnit::kAuto ? TimeUnit::kSeconds : input.time_unit,
      input.time_reference == TimeReference::kAuto ? TimeReference::kScan : input.time_reference,
      values.high};
  if (!values.any) return reading;
  const std::vector<Unit> units = allowedUnits(input);
  const bool automatic = input.time_reference == TimeReference::kAuto;
  const double low = values.low, high = values.high;
  if (automatic || reading.reference == TimeReference::kAbsolute) {
    // Near the start of simulated time, offsets from 0 on are no further from the stamp than the stamp
    // itself.
    const double near = automatic ? std::min(kLongestScan, 0.5 * stamp.toSec()) : kLongestScan;
    const auto unit =
        absoluteUnit(values, units, stamp.toSec(), near, automatic ? kLongestTurn : kLongestScan);
    const Unit& usual = factsOf(values.integer ? TimeUnit::kNanoseconds : TimeUnit::kSeconds);
    const double largest = std::max(std::abs(low), std::abs(high));
    if (automatic && unit && unit->unit == usual.unit && unit->seconds * largest <= kLongestTurn) {
      throw std::invalid_argument(
          timesText(values, input) +
          " may count from the start of simulated time or from the stamp, which is as early; set "
          "time_reference");
    }
    if (unit) return {unit->unit, TimeReference::kAbsolute, high};
    if (!automatic) throw std::invalid_argument(noTimes(values, input, stamp));
  }
  double largest = std::max(std::abs(low), std::abs(high));
  if (reading.reference == TimeReference::kScanEnd) largest = high - low;
  if (input.time_unit == TimeUnit::kAuto) reading.unit = offsetUnit(values, input, largest, stamp).unit;
  if (factsOf(reading.unit).seconds * largest > kLongestScan) {
    throw std::invalid_argument(noTimes(values, input, stamp));
  }
  const bool beside = std::min(std::abs(low), std::abs(high)) * factsOf(reading.unit).seconds > kLongestTurn;
  if (automatic && beside && (low > 0.0) == (high > 0.0)) {  // no scan begins or ends at the stamp
    throw std::invalid_argument(noTimes(values, input, stamp));
  }
  const bool whole = factsOf(reading.unit).seconds * (high - low) >= kShortestScan;
  if (automatic && whole && values.falling && low >= 0.0) {
    throw std::invalid_argument(timesText(values, input) +
                                " fall from point to point: they may count up to the stamp, or points may be "
                                "stored backwards; set time_reference to until_stamp or to scan");
  }
  return reading;
}

}  // namespace bki_mapping::ros_interface
