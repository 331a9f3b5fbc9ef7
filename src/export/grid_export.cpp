#include "export/grid_export.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "bki_mapping/core/named_parameter.h"
#include "core/atomic_file.h"

namespace bki_mapping {
namespace {

constexpr std::int64_t kMostCells = std::int64_t{1} << 28;

/// The stacks that the image holds.
struct Extent {
  std::int32_t min_x = std::numeric_limits<std::int32_t>::max(), min_y = min_x;
  std::int32_t max_x = std::numeric_limits<std::int32_t>::min(), max_y = max_x;

  std::int64_t width() const {
    return max_x < min_x ? 0 : std::int64_t{kBlockEdge} * (max_x - min_x + 1);
  }  ///< [cells]
  std::int64_t height() const { return max_y < min_y ? 0 : std::int64_t{kBlockEdge} * (max_y - min_y + 1); }
};

Extent extentOf(const ColumnMap& columns) {
  Extent extent;
  for (const auto& [stack, views] : columns.columns()) {
    extent.min_x = std::min(extent.min_x, stack.first);
    extent.max_x = std::max(extent.max_x, stack.first);
    extent.min_y = std::min(extent.min_y, stack.second);
    extent.max_y = std::max(extent.max_y, stack.second);
  }
  return extent;
}

/// As map_saver writes it.
char grey(ColumnView::Occupancy occupancy) {
  switch (occupancy) {
    case ColumnView::Occupancy::kFree:
      return static_cast<char>(254);
    case ColumnView::Occupancy::kOccupied:
      return 0;
    default:
      return static_cast<char>(205);
  }
}

/// A binary PGM; rows from the top.
std::string image(const ColumnMap& columns, const Extent& extent) {
  const std::int64_t width = extent.width(), height = extent.height();
  std::string bytes = "P5\n" + std::to_string(width) + " " + std::to_string(height) + "\n255\n";
  const std::size_t begin = bytes.size();
  bytes.resize(begin + static_cast<std::size_t>(width * height), grey(ColumnView::Occupancy::kUnknown));
  for (const auto& [stack, views] : columns.columns()) {
    for (std::size_t c = 0; c < views.size(); ++c) {
      const auto cell = static_cast<std::int64_t>(c);
      const std::int64_t x = std::int64_t{kBlockEdge} * (stack.first - extent.min_x) + cell % kBlockEdge;
      const std::int64_t y = std::int64_t{kBlockEdge} * (stack.second - extent.min_y) + cell / kBlockEdge;
      bytes[begin + static_cast<std::size_t>((height - 1 - y) * width + x)] = grey(views[c].occupancy);
    }
  }
  return bytes;
}

}  // namespace

std::string gridImagePath(const std::string& path) {
  return std::filesystem::path(path).replace_extension(".pgm").string();
}

void exportGrid(const std::string& path, const SemanticMap& map, const StateRules& rules,
                const ClassTable& classes, const ColumnRules& column_rules) {
  ColumnMap columns;
  columns.start(column_rules);
  columns.update(map, rules, classes);
  const Extent extent = extentOf(columns);
  if (extent.width() == 0)
    throw std::invalid_argument("the map is empty, and map_server refuses empty images");
  if (extent.width() > kMostCells || extent.height() > kMostCells / extent.width()) {
    throw std::invalid_argument("the image would have " + std::to_string(extent.width()) + " x " +
                                std::to_string(extent.height()) +
                                " cells, and 2^28 are allowed; clear what lies far away with clear_map");
  }
  const double stack_edge = map.geometry().blockSize();
  YAML::Emitter yaml;
  yaml << YAML::BeginMap << YAML::Key << "image" << YAML::Value << YAML::DoubleQuoted
       << std::filesystem::path(gridImagePath(path)).filename().string();
  yaml << YAML::Key << "resolution" << YAML::Value << numberText(map.geometry().resolution());
  yaml << YAML::Key << "origin" << YAML::Value << YAML::Flow << YAML::BeginSeq
       << numberText(extent.min_x * stack_edge) << numberText(extent.min_y * stack_edge) << "0"
       << YAML::EndSeq;
  yaml << YAML::Key << "negate" << YAML::Value << 0;
  yaml << YAML::Key << "occupied_thresh" << YAML::Value << "0.65";
  yaml << YAML::Key << "free_thresh" << YAML::Value << "0.196";
  yaml << YAML::Key << "mode" << YAML::Value << "trinary" << YAML::EndMap;
  writeTextFile(gridImagePath(path), image(columns, extent));
  writeTextFile(path, std::string(yaml.c_str()) + "\n");
}

}  // namespace bki_mapping
