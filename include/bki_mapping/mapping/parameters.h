/// @file The named parameters of MapperConfig.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "bki_mapping/core/named_parameter.h"
#include "bki_mapping/mapping/mapper_config.h"

namespace bki_mapping {

using Parameter = NamedParameter<MapperConfig>;

/// All parameters of the mapper in the order of the documentation. Those of a component are defined in its
/// room, in `*_parameters.h`.
std::vector<Parameter> mapperParameters();

/// setNamedParameters() for the mapper's parameters.
void setParameters(MapperConfig& config, const std::map<std::string, std::string>& values);

/// checkNamedParameters() for the mapper's parameters.
void checkParameters(const MapperConfig& config);

/// @throws std::invalid_argument that names a parameter that differs but can change only at the start.
void checkChanges(const MapperConfig& before, const MapperConfig& after);

/// One sentence for each setting that is allowed but probably not intended.
std::vector<std::string> settingWarnings(const MapperConfig& config);

}  // namespace bki_mapping
