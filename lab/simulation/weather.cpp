#include "simulation/weather.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "bki_mapping/core/named_parameter.h"
#include "core/pi.h"
#include "simulation/street_parts.h"

namespace bki_mapping::simulation {
namespace {

constexpr const char* kKinds[] = {"dry", "rain", "snow", "fog", "dust"};
constexpr const char* kLabels[] = {"vegetation", "car", "person", "unlabelled", "mixed", "airborne"};

// The beam of a lidar on a car, after Velodyne's data sheets: 3 mrad wide, and nothing is seen within 1 m.
constexpr double kWidth = 0.015, kDivergence = 0.003, kNearest = 1.0;
constexpr double kFullView = 5.0;  ///< from where the receiver sees all of the beam [m]
constexpr double kPieceLength = 0.25, kFarthestParticle = 40.0;  ///< [m]
constexpr double kPulseLength = 3.0;  ///< of a pulse of 20 ns, over which fog adds up [m]
// Fractions of the light that come back.
constexpr double kTarget = 0.3, kFaintest = 0.1, kWetRoad = 0.03, kDrop = 0.05, kFlake = 0.6;
constexpr double kFlakeOverDrop = 2.15;  ///< diameter of a flake, a tenth as dense as the drop it melts to

/// Number of drops per volume and diameter, N0 exp(-L D).
struct DropSizes {
  double n0;     ///< [1/m^4]
  double slope;  ///< L [1/m]
};

DropSizes dropSizes(const WeatherConfig& config) {
  if (config.kind == WeatherKind::kRain) return {8e6, 4.1e3 * std::pow(config.rate, -0.21)};
  const double melted_n0 = 3.8e6 * std::pow(config.rate, -0.87);
  const double melted_slope = 2.55e3 * std::pow(config.rate, -0.48);
  return {melted_n0 / kFlakeOverDrop, melted_slope / kFlakeOverDrop};
}

/// What divides the power that comes back from a particle: r^2, nearby less of it is in view.
double dilution(double range) {
  return std::pow(std::max(range, kFullView), 2);
}

bool isGround(std::uint32_t label) {
  const Ground ground;
  return label == ground.road || label == ground.sidewalk;
}

/// The place of a name in a list. @param what is named, for the message.
template <std::size_t n>
int indexOf(const std::string& name, const char* const (&names)[n], const std::string& what) {
  const auto found = std::find(std::begin(names), std::end(names), name);
  if (found != std::end(names)) return static_cast<int>(found - std::begin(names));
  std::string known;
  for (const char* each : names) known += (known.empty() ? "" : ", ") + std::string(each);
  throw std::invalid_argument("there is no " + what + " " + name + "; known: " + known);
}

}  // namespace

void setWeather(const std::string& text, WeatherConfig& config) {
  const std::size_t comma = text.find(',');
  config.kind = static_cast<WeatherKind>(indexOf(text.substr(0, comma), kKinds, "weather"));
  config.rate = 0.0;
  if (config.kind == WeatherKind::kDry && comma == std::string::npos) return;
  std::istringstream rate(comma == std::string::npos ? "" : text.substr(comma + 1));
  const bool falls = config.kind == WeatherKind::kRain || config.kind == WeatherKind::kSnow;
  const double least = falls ? 0.01 : 5.0, most = falls ? 200.0 : 10000.0;
  if (rate >> config.rate && rate.eof() && config.rate >= least && config.rate <= most &&
      config.kind != WeatherKind::kDry) {
    return;
  }
  throw std::invalid_argument("the weather is " + text +
                              ", but must be dry, or a kind and a number: rain or "
                              "snow in mm/h from 0.01 to 200, fog or dust by how far one sees in m from 5 to "
                              "10000, such as rain,10 or fog,50");
}

std::string nameOf(const WeatherConfig& config) {
  const std::string kind = kKinds[static_cast<int>(config.kind)];
  return config.kind == WeatherKind::kDry ? kind : kind + "," + numberText(config.rate);
}

ParticleLabels particleLabelsNamed(const std::string& name) {
  return static_cast<ParticleLabels>(indexOf(name, kLabels, "label of particles"));
}

std::string nameOf(ParticleLabels labels) {
  return kLabels[static_cast<int>(labels)];
}

Weather::Weather(const WeatherConfig& config, double max_range)
    : config_(config), least_power_(kFaintest / (max_range * max_range)) {
  if (config.kind == WeatherKind::kDry) return;
  DropSizes drops{0.0, 1.0};
  double backscatter = 0.0;
  if (config.kind == WeatherKind::kRain || config.kind == WeatherKind::kSnow) {
    drops = dropSizes(config);
    slope_ = drops.slope;
    reflectivity_ = config.kind == WeatherKind::kRain ? kDrop : kFlake;
    // Large drops take away twice the light that falls on them: pi/2 times the sum of D^2 N(D).
    extinction_ = kPi * drops.n0 / std::pow(slope_, 3);
  } else {
    extinction_ = std::log(20.0) / config.rate;
    backscatter = 0.046 / config.rate;
  }
  double sum = 0.0;
  for (double range = kNearest; range < kFarthestParticle; range += kPieceLength) {
    Piece piece = {};
    piece.range = range + 0.5 * kPieceLength;
    piece.width = kWidth + kDivergence * piece.range;
    piece.drops = 0.25 * kPi * piece.width * piece.width * kPieceLength * drops.n0 / drops.slope;
    piece.mist =
        kPi * backscatter * kPulseLength * std::exp(-2.0 * extinction_ * piece.range) / dilution(piece.range);
    piece.before = sum;
    sum += piece.mist;
    pieces_.push_back(piece);
  }
}

double Weather::powerOf(const Return& dry, double down) const {
  if (dry.range == 0.0) return 0.0;
  const bool wet = config_.kind == WeatherKind::kRain && !dry.shape && isGround(dry.label);
  const double reflectivity = wet ? kWetRoad * std::max(down, 0.0) : kTarget;
  return reflectivity * std::exp(-2.0 * extinction_ * dry.range) / (dry.range * dry.range);
}

double Weather::findDrop(double end, double power, BeamDice& dice) const {
  if (reflectivity_ == 0.0) return 0.0;
  double left = -std::log(1.0 - dice.next());
  for (const Piece& piece : pieces_) {
    if (piece.range >= end) break;
    const double air = std::exp(-2.0 * extinction_ * piece.range);
    const double diameter = piece.width * std::sqrt(power * dilution(piece.range) / (reflectivity_ * air));
    if (diameter > piece.width) break;  // no drop is larger than the beam
    left -= piece.drops * std::exp(-slope_ * diameter);
    if (left < 0.0) return piece.range + kPieceLength * (dice.next() - 0.5);
  }
  return 0.0;
}

double Weather::findMist(double end, double power, BeamDice& dice) const {
  double sum = 0.0, strongest = 0.0;
  for (const Piece& piece : pieces_) {
    if (piece.range >= end) break;
    sum = piece.before + piece.mist;
    strongest = std::max(strongest, piece.mist);
  }
  if (!(strongest > power)) return 0.0;
  const double at = dice.next() * sum;
  const auto after = std::upper_bound(pieces_.begin(), pieces_.end(), at,
                                      [](double value, const Piece& piece) { return value < piece.before; });
  return (after - 1)->range + kPieceLength * (dice.next() - 0.5);
}

Return Weather::particleAt(double range, BeamDice& dice) const {
  constexpr std::uint32_t kRaw[] = {kVegetation, kCar, kPerson, 0, 0, kAirborneLabel};
  auto labels = static_cast<std::size_t>(config_.labels);
  if (config_.labels == ParticleLabels::kMixed) labels = static_cast<std::size_t>(4.0 * dice.next());
  return {range, kParticle | kRaw[labels], nullptr};
}

Return Weather::seenThrough(const Return& dry, double down, BeamDice& dice) const {
  if (config_.kind == WeatherKind::kDry) return dry;
  const double power = powerOf(dry, down);
  const double end = dry.range == 0.0 ? kFarthestParticle : dry.range;
  const double other = std::max(power, least_power_);
  double range = findDrop(end, other, dice);
  if (range == 0.0) range = findMist(end, other, dice);
  if (range > 0.0) return particleAt(range, dice);
  return power < least_power_ ? Return{} : dry;
}

double findSteam(const std::vector<const Shape*>& shapes, const Eigen::Vector3d& origin,
                 const Eigen::Vector3d& direction, double time, double end, BeamDice& dice) {
  constexpr double kEndsIn = 0.5;  // fraction of the beams
  for (const Shape* car : shapes) {
    if (car->label != kMovingCar || car->half.x() < 2.0) continue;  // a car is a body and a cabin
    Eigen::Vector3d forward = car->centreAt(time + 0.5) - car->centreAt(time - 0.5);
    if (forward.norm() < 0.1) forward = Eigen::Vector3d::UnitX();
    Shape steam{ShapeType::kEllipsoid,
                car->centreAt(time) - (car->half.x() + 0.8) * forward.normalized(),
                {0.8, 0.6, 0.5}};
    const auto enters = steam.hit(origin, direction, time);
    if (!enters || *enters >= end) continue;
    if (dice.next() > kEndsIn) continue;
    const double deep = *enters + 1.0 * dice.next();
    if (deep < end && steam.contains(origin + deep * direction, time)) return deep;
  }
  return 0.0;
}

}  // namespace bki_mapping::simulation
