/// @file How a setting gets a name: one description serves files, command lines, ROS and the documentation.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

namespace bki_mapping {

/// One named setting of a struct `Config`. Values are text as YAML writes it.
template <typename Config>
struct NamedParameter {
  std::string name;         ///< with `/` between the parts, as in ROS
  std::string values;       ///< the values allowed, in words
  std::string unit;         ///< "" where it has none
  std::string description;  ///< one sentence
  /// @throws std::invalid_argument naming the parameter, the value and the values allowed.
  std::function<void(Config&, const std::string& value)> set;
  std::function<std::string(const Config&)> get;
};

/// "; did you mean 'X'?" for the known word nearest in spelling; "" where none is near.
std::string nearestWord(const std::string& word, const std::vector<std::string>& known);

/// The shortest text that names a number to 15 digits.
std::string numberText(double value);
/// The number that a whole text names; NaN if it names none.
double parseNumber(const std::string& text);

/// Text of unknown origin as part of a sentence: whoever sends it must not choose how long the sentence is,
/// nor what it does to a terminal. Control characters become '?', and what is longer than `most` bytes is
/// cut.
std::string shortText(const std::string& text, std::size_t most = 100);

/// @throws std::invalid_argument.
[[noreturn]] void refuseValue(const std::string& name, const std::string& value, const std::string& values);

/// A real number for which `allowed` holds. `field` maps Config& to double&.
template <typename Config, typename Field, typename Allowed>
NamedParameter<Config> realParameter(const std::string& name, const std::string& values,
                                     const std::string& unit, const std::string& description, Field field,
                                     Allowed allowed) {
  return {name,
          values,
          unit,
          description,
          [=](Config& config, const std::string& value) {
            const double number = parseNumber(value);
            if (!std::isfinite(number) || !allowed(number)) refuseValue(name, value, values);
            field(config) = number;
          },
          [=](const Config& config) { return numberText(field(const_cast<Config&>(config))); }};
}

template <typename Config, typename Field>
NamedParameter<Config> integerParameter(const std::string& name, double least, double most,
                                        const std::string& description, Field field) {
  const std::string values = "an integer from " + numberText(least) + " to " + numberText(most);
  return {name,
          values,
          "",
          description,
          [=](Config& config, const std::string& value) {
            const double number = parseNumber(value);
            if (!(number >= least && number <= most) || number != std::floor(number)) {
              refuseValue(name, value, values);
            }
            field(config) = static_cast<std::remove_reference_t<decltype(field(config))>>(number);
          },
          [=](const Config& config) { return std::to_string(field(const_cast<Config&>(config))); }};
}

/// One of several words; `names` stand in the order of the enumeration (or of false, true).
template <typename Config, typename Field>
NamedParameter<Config> choiceParameter(const std::string& name, const std::vector<std::string>& names,
                                       const std::string& description, Field field) {
  std::string values = "one of";
  for (const auto& word : names) values += (&word == &names.front() ? " " : ", ") + word;
  return {name,
          values,
          "",
          description,
          [=](Config& config, const std::string& value) {
            const auto found = std::find(names.begin(), names.end(), value);
            if (found == names.end()) refuseValue(name, value, values + nearestWord(value, names));
            using Value = std::remove_reference_t<decltype(field(config))>;
            field(config) = static_cast<Value>(found - names.begin());
          },
          [=](const Config& config) {
            return names[static_cast<std::size_t>(field(const_cast<Config&>(config)))];
          }};
}

/// Any text. `field` maps Config& to std::string&.
template <typename Config, typename Field>
NamedParameter<Config> textParameter(const std::string& name, const std::string& values,
                                     const std::string& description, Field field) {
  return {name,
          values,
          "",
          description,
          [=](Config& config, const std::string& value) { field(config) = value; },
          [=](const Config& config) { return field(const_cast<Config&>(config)); }};
}

/// Sets several parameters at once.
/// @throws std::invalid_argument that lists every unknown name (with the nearest known one) and every value
/// that is not allowed; `config` is then unchanged.
template <typename Config>
void setNamedParameters(const std::vector<NamedParameter<Config>>& parameters, Config& config,
                        const std::map<std::string, std::string>& values) {
  std::vector<std::string> names;
  for (const auto& p : parameters) names.push_back(p.name);
  Config changed = config;
  std::string faults;
  for (const auto& [name, value] : values) {
    try {
      const auto found = std::find(names.begin(), names.end(), name);
      if (found == names.end()) {
        throw std::invalid_argument("parameter '" + name + "' is unknown" + nearestWord(name, names));
      }
      parameters[static_cast<std::size_t>(found - names.begin())].set(changed, value);
    } catch (const std::invalid_argument& fault) {
      faults += (faults.empty() ? "" : "; ") + std::string(fault.what());
    }
  }
  if (!faults.empty()) throw std::invalid_argument(faults);
  config = changed;
}

}  // namespace bki_mapping
