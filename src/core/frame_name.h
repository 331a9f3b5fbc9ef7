/// @file Names of coordinate frames.
#pragma once

#include <string>

namespace bki_mapping {

/// The name of a frame without one leading slash, as in tf2: older drivers and launch files write '/map' for
/// 'map'.
inline std::string frameName(const std::string& text) {
  return text.empty() || text.front() != '/' ? text : text.substr(1);
}

}  // namespace bki_mapping
