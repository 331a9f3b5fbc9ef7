/// @file Leaves out rules of the mapper, to measure what each gives.
#pragma once

#include <string>

#include "bki_mapping/mapping/mapper_config.h"

namespace bki_mapping {

/// The rules that can be left out, by name, separated by commas.
std::string namesOfRules();

/// The settings without one of these rules of docs/method.md, "Ours".
/// @throws std::invalid_argument if there is no such rule, or rules/enabled is false.
MapperConfig withoutRule(MapperConfig config, const std::string& name);

}  // namespace bki_mapping
