#include "evaluation/octomap_settings.h"

#include <map>
#include <sstream>
#include <stdexcept>

namespace bki_mapping {
namespace {

std::vector<NamedParameter<OctomapSettings>> octomapParameters() {
  using C = OctomapSettings;
  const NumberRange probability = NumberRange::above(0.0).upTo(1.0 - 1e-6);
  const auto real = [](const char* name, double C::*field, const NumberRange& range, const char* unit = "") {
    return realParameter(name, field, range, unit, Changes::kAtStart, "");
  };
  const auto truth = [](const char* name, bool C::*field) {
    return truthParameter(name, field, Changes::kAtStart, "");
  };
  return {
      real("max_range", &C::max_range, NumberRange::above(0.0).orElse(-1.0, "no limit"), "m"),
      real("hit", &C::hit, NumberRange::above(0.5).upTo(1.0 - 1e-6)),
      real("miss", &C::miss, NumberRange::above(0.0).upTo(0.5 - 1e-6)),
      real("min", &C::min, probability),
      real("max", &C::max, probability),
      real("threshold", &C::threshold, probability),
      truth("discretize", &C::discretize),
      truth("rays", &C::rays),
      truth("lazy", &C::lazy),
      truth("compress_map", &C::compress_map),
  };
}

}  // namespace

OctomapSettings octomapSettings(const std::string& text) {
  OctomapSettings settings;
  if (text == "default") return settings;
  std::map<std::string, std::string> values;
  std::istringstream in(text);
  for (std::string setting; std::getline(in, setting, ',');) {
    const std::size_t equals = setting.find('=');
    if (equals == std::string::npos) {
      throw std::invalid_argument("OctoMap's setting '" + shortText(setting) +
                                  "' has no '='; give default, or NAME=VALUE,...");
    }
    if (!values.emplace(setting.substr(0, equals), setting.substr(equals + 1)).second)
      throw std::invalid_argument("OctoMap's setting " + shortText(setting.substr(0, equals)) +
                                  " is given twice");
  }
  if (values.empty()) throw std::invalid_argument("OctoMap has no settings; give default, or NAME=VALUE,...");
  setNamedParameters(octomapParameters(), settings, values);
  if (settings.min >= settings.max)
    throw std::invalid_argument("OctoMap's min must be below its max, the limits of its probabilities");
  if (settings.rays && (settings.discretize || settings.max_range > 0.0))
    throw std::invalid_argument("OctoMap ignores max_range and discretize with rays=true; leave them out");
  return settings;
}

}  // namespace bki_mapping
