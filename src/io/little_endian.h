/// @file Values as bytes.
#pragma once

#include <cstring>
#include <string>

namespace bki_mapping {

/// Appends a value's bytes, little-endian (as all hosts that ROS 1 supports are).
template <typename T>
void appendBytes(std::string& bytes, T value) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  bytes.append(raw, sizeof(T));
}

}  // namespace bki_mapping
