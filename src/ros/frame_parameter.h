/// @file Parameters that name a frame.
#pragma once

#include <string>

#include "bki_mapping/core/named_parameter.h"
#include "core/frame_name.h"

namespace bki_mapping::ros_interface {

/// A frame of tf, or empty. One leading slash is removed; more are refused, as tf2 knows no such frame.
template <typename Config>
NamedParameter<Config> frameParameter(const std::string& name, std::string Config::*field,
                                      const std::string& values, Changes changes,
                                      const std::string& description) {
  const auto parse = [](const std::string& text) {
    const std::string frame = frameName(text);
    return frame == frameName(frame) ? std::optional(frame) : std::nullopt;
  };
  const auto same = [](const std::string& frame) { return frame; };
  const auto allows = [](const std::string& frame) { return frame == frameName(frame); };
  return memberParameter<Config>({name, ParameterType::kText, values, "", description, changes, {}, {}},
                                 field, parse, same, allows);
}

}  // namespace bki_mapping::ros_interface
