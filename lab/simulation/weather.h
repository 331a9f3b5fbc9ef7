/// @file What weather and steam do to the beams of a simulated lidar.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "parallel/counter_random.h"
#include "simulation/scene.h"

namespace bki_mapping::simulation {

enum class WeatherKind { kDry, kRain, kSnow, kFog, kDust };

/// The labels that a network gives to particles.
enum class ParticleLabels {
  kAsVegetation,
  kAsCar,
  kAsPerson,
  kAsUnlabelled,
  kMixed,     ///< each particle has one of the above
  kAirborne,  ///< a class of their own, kAirborneLabel
};

struct WeatherConfig {
  WeatherKind kind = WeatherKind::kDry;
  /// Rain and snow: water that falls [mm/h]. Fog and dust: the meteorological optical range, how far one sees
  /// [m].
  double rate = 0.0;
  ParticleLabels labels = ParticleLabels::kAsVegetation;
  bool steam = false;  ///< whether cars that move leave steam behind
  bool glass = false;  ///< whether houses have windows
};

/// Raw label of particles that have a class of their own; SemanticKITTI does not use it.
constexpr std::uint32_t kAirborneLabel = 110;
/// In the upper 16 bits of a simulated label, where SemanticKITTI has the instance: what is not there.
constexpr std::uint32_t kParticle = 0xffffu << 16;  ///< a drop, a flake, fog, dust or steam
constexpr std::uint32_t kImage = 0xfffeu << 16;     ///< what a pane mirrors, beyond its wall
constexpr bool isParticle(std::uint32_t label) {
  return (label & 0xffff0000u) == kParticle;
}
constexpr bool isImage(std::uint32_t label) {
  return (label & 0xffff0000u) == kImage;
}
constexpr bool isNothing(std::uint32_t label) {
  return isParticle(label) || isImage(label);
}

/// Sets kind and rate by a text: "dry", or for example "snow,1.5".
/// @throws std::invalid_argument if the text is neither.
void setWeather(const std::string& text, WeatherConfig& config);
/// The text that sets them.
std::string nameOf(const WeatherConfig& config);
/// @throws std::invalid_argument if there are no labels of this name.
ParticleLabels particleLabelsNamed(const std::string& name);
/// "vegetation", "car", "person", "unlabelled", "mixed" or "airborne".
std::string nameOf(ParticleLabels labels);

/// What a beam sees.
struct Return {
  double range = 0.0;  ///< [m]; 0: no return
  std::uint32_t label = 0;
  const Shape* shape = nullptr;  ///< nullptr: the ground, or nothing
};

/// The random numbers of one beam, each uniform on [0, 1).
class BeamDice {
 public:
  BeamDice(std::uint64_t seed, std::uint64_t scan, std::uint64_t beam)
      : key_(CounterRandom(seed, scan).beamKey(beam)) {}
  double next() { return CounterRandom::draw(key_, count_++); }

 private:
  std::uint64_t key_;
  std::uint64_t count_ = 4;  ///< earlier ones are the noise of the lidar
};

/// Which return of a beam a lidar reports: the strongest, by the power rho / r^2 that comes back from a
/// reflectivity rho at the range r, less what the air takes away, and less within 5 m, where the receiver
/// sees only a part of the beam. What returns less than a target of a tenth at max_range is not seen.
///
/// Rain and snow are single drops and flakes. One of diameter D reflects the part (D / d)^2 of a beam that
/// is d wide, and N(D) = N0 exp(-L D) per volume: Marshall and Palmer (1948) for rain, Gunn and Marshall
/// (1958) for snow. So most are seen within some metres, and more of them on beams that go far. On a wet
/// road, a tenth of the light comes back.
///
/// Fog and dust return light from everywhere: the extinction is ln(20) / V and the backscatter 0.046 / V for
/// an optical range V (Rasshofer, Spies and Spies 2011; Hahner et al. 2021). Where a target returns less than
/// that, the lidar reports a place in the fog, the more likely the more light comes back from there.
class Weather {
 public:
  /// @param max_range of the lidar [m].
  Weather(const WeatherConfig& config, double max_range);

  /// @param dry what the beam would see in dry air. @param down how steeply it points down: -sin(elevation).
  Return seenThrough(const Return& dry, double down, BeamDice& dice) const;
  /// A return of a particle. @param range [m].
  Return particleAt(double range, BeamDice& dice) const;

 private:
  /// A piece of a beam.
  struct Piece {
    double range;   ///< of its middle [m]
    double width;   ///< of the beam there [m]
    double drops;   ///< mean number of drops of all sizes in it
    double mist;    ///< power that comes back from fog in it
    double before;  ///< the sum of `mist` over the nearer pieces
  };
  double powerOf(const Return& dry, double down) const;
  /// The range at which a drop returns more than `power`; 0 if none does.
  double findDrop(double end, double power, BeamDice& dice) const;
  /// The same for fog.
  double findMist(double end, double power, BeamDice& dice) const;

  WeatherConfig config_;
  double least_power_;         ///< that is seen
  double extinction_ = 0.0;    ///< [1/m]
  double slope_ = 0.0;         ///< L of the diameters of drops [1/m]
  double reflectivity_ = 0.0;  ///< of drops
  std::vector<Piece> pieces_;
};

/// Where a beam ends in the steam behind cars. @param shapes that the beam may hit. @param end of the beam
/// without steam [m]. @return range [m]; 0 if it does not.
double findSteam(const std::vector<const Shape*>& shapes, const Eigen::Vector3d& origin,
                 const Eigen::Vector3d& direction, double time, double end, BeamDice& dice);

}  // namespace bki_mapping::simulation
