/// @file Classes in messages.
#pragma once

#include <bki_mapping/ClassInfo.h>

#include "bki_mapping/core/class_table.h"

namespace bki_mapping::ros_interface {

inline ClassInfo toMessage(const SemanticClass& c) {
  ClassInfo info;
  info.id = c.id;
  info.name = c.name;
  info.red = c.color[0];
  info.green = c.color[1];
  info.blue = c.color[2];
  info.dynamic = c.dynamic;
  return info;
}

}  // namespace bki_mapping::ros_interface
