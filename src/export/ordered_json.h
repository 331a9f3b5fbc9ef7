/// @file JSON objects whose names stay in the order in which they were added.
#pragma once

#include <nlohmann/json.hpp>

namespace bki_mapping {

#if NLOHMANN_JSON_VERSION_MAJOR > 3 || NLOHMANN_JSON_VERSION_MINOR >= 9
using OrderedJson = nlohmann::ordered_json;
#else  // Ubuntu 20.04 has 3.7, whose objects sort their names
using OrderedJson = nlohmann::json;
#endif

}  // namespace bki_mapping
