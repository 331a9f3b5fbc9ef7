/// @file The mapper's parameters by name: one table serves files, command lines, ROS and the documentation.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "bki_mapping/core/config.h"

namespace bki_mapping {

/// One named setting of MapperConfig. Values are text as YAML writes it.
struct Parameter {
  std::string name;         ///< with `/` between the parts, as in ROS
  std::string values;       ///< the values allowed, in words
  std::string unit;         ///< "" where it has none
  std::string description;  ///< one sentence
  /// @throws std::invalid_argument naming the parameter, the value and the values allowed.
  std::function<void(MapperConfig&, const std::string& value)> set;
  std::function<std::string(const MapperConfig&)> get;
};

/// All parameters of the mapper, in the order in which they are documented.
std::vector<Parameter> mapperParameters();

/// Sets several parameters at once.
/// @throws std::invalid_argument that lists every unknown name (with the nearest known one) and every value
/// that is not allowed; `config` is then unchanged.
void setParameters(MapperConfig& config, const std::map<std::string, std::string>& values);

/// "; did you mean 'X'?" for the known word nearest in spelling; "" where none is near.
std::string nearestWord(const std::string& word, const std::vector<std::string>& known);

}  // namespace bki_mapping
