/// @file The health reported on /diagnostics.
#pragma once

#include <cstdint>
#include <string>

namespace bki_mapping::ros_interface {

/// A level of diagnostic_msgs/DiagnosticStatus, and its message.
struct Health {
  std::uint8_t level = 0;
  std::string message;
};

}  // namespace bki_mapping::ros_interface
