/// @file A verdict for /diagnostics.
#pragma once

#include <cstdint>
#include <string>

namespace bki_mapping::ros_shell {

/// Level and message of a status: the level is one of diagnostic_msgs/DiagnosticStatus.
struct Health {
  std::uint8_t level = 0;
  std::string message;
};

}  // namespace bki_mapping::ros_shell
