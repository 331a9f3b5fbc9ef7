/// @file Names of coordinate frames, and parameters that have one.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "bki_mapping/core/named_parameter.h"

namespace bki_mapping {

/// The name of a frame without one leading slash, as in tf2: older drivers and launch files write '/map' for
/// 'map'.
inline std::string frameName(const std::string& text) {
  return text.empty() || text.front() != '/' ? text : text.substr(1);
}

/// A frame of tf, or empty. One leading slash is removed; more are refused, as tf2 knows no such frame.
struct FrameKind : kinds::Text {
  static std::optional<std::string> parse(const ParameterFacts& facts, const std::string& text) {
    const std::string frame = frameName(text);
    return allows(facts, frame) ? std::optional(frame) : std::nullopt;
  }
  static bool allows(const ParameterFacts&, const std::string& frame) { return frame == frameName(frame); }
};

template <typename Config>
NamedParameter<Config> frameParameter(std::string_view name, std::string Config::*field,
                                      std::string_view values, Changes changes,
                                      std::string_view description) {
  return memberParameter<FrameKind>(textFacts(name, values, changes, description), field);
}

}  // namespace bki_mapping
