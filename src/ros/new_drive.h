/// @file The drive that begins when a server starts, or its map is reset.
#pragma once

#include <string>

#include "bki_mapping/store/map_file.h"

namespace bki_mapping::ros_interface {

/// A drive without scans, with an id that no other drive of any robot has.
/// @param name for people; the time is added to it.
DriveRecord newDrive(const std::string& name);

}  // namespace bki_mapping::ros_interface
