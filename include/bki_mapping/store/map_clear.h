/// @file Clears a box of a map file.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <string>

namespace bki_mapping {

/// How many blocks and tiles of the sum of all drives changed or were erased.
struct ClearedFile {
  std::uint64_t blocks = 0, tiles = 0;
};

/// Clears a box of a map file, as clearBox() does of a map: in the sum of all drives, and in the parts that
/// hold drives apart. The drives stay in the list of drives.
/// @param output file for the result, by NewMapFile; "" or the same file: the file itself is changed, as a
/// whole or not at all. It then keeps its size, and new evidence takes the place of the old.
/// @throws MapFileError if a file cannot be read or written, or is in use; std::invalid_argument if a corner
/// of the box is not a number.
ClearedFile clearBoxOfFile(const std::string& path, const Eigen::AlignedBox3d& box,
                           const std::string& output = "");

}  // namespace bki_mapping
