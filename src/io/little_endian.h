/// @file Serialises values as little-endian bytes.
#pragma once

#include <cstring>
#include <string>

namespace bki_mapping {

/// Appends a value's bytes in host order, which is little-endian on all platforms of ROS 1.
template <typename T>
void appendBytes(std::string& bytes, T value) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  bytes.append(raw, sizeof(T));
}

}  // namespace bki_mapping
