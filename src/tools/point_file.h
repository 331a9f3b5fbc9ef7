/// @file Points as text: "X Y Z" on a command line, and files with lines x,y,z.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

namespace bki_mapping::tools {

/// Three finite numbers, separated by commas or spaces. @return nothing if the text is anything else.
std::optional<Eigen::Vector3d> parsePoint(std::string text);

/// Appends the points of a file, one a line; "-": of standard input. Empty lines, lines that begin with #,
/// and a first line of names are left out. @throws std::invalid_argument if the file cannot be read, a line
/// is not a point, or `points` would have more than ten million.
void readPointFile(const std::string& path, std::vector<Eigen::Vector3d>& points);

}  // namespace bki_mapping::tools
