/// @file Clears a box of a map file.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <string>

namespace bki_mapping {

/// The number of blocks and tiles, in the sum of all drives, that were changed or erased.
struct ClearedFile {
  std::uint64_t blocks = 0, tiles = 0;
};

/// Does to a map file what clearBox() does to a map, both to the sum of all drives and to the parts of single
/// drives. Drives without evidence left stay in the list of drives.
/// @param output file for the result, written by NewMapFile. If it is "" or the same file, the file itself is
/// changed, completely or not at all; it does not shrink, but later evidence reuses the free space.
/// @throws MapFileError if a file cannot be read or written, or is in use; std::invalid_argument if a corner
/// of the box is not a number.
ClearedFile clearBoxOfFile(const std::string& path, const Eigen::AlignedBox3d& box,
                           const std::string& output = "");

}  // namespace bki_mapping
