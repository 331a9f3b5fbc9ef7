#include "bki_mapping/query/column_map.h"

#include <algorithm>

#include "rules/neighbourhood.h"

namespace bki_mapping {
namespace {

/// One voxel of a column.
struct Cell {
  std::int32_t z;  ///< of the voxel's index
  VoxelState state;
  ClassId label;
};

/// The known voxels of one column, from bottom to top.
using Cells = std::vector<Cell>;

ColumnView viewColumn(const Cells& cells, const ClassTable& classes, const ColumnRules& rules,
                      double resolution) {
  const auto isGround = [&](const Cell& cell) {
    return cell.state == VoxelState::kOccupied && classes.find(cell.label)->ground;
  };
  ColumnView view;
  auto above = std::find_if(cells.begin(), cells.end(), isGround);
  const bool grounded = above != cells.end();
  const std::int32_t bottom = grounded ? above->z : 0;  // of the ground
  if (grounded) {
    std::int32_t top = bottom;
    for (; above != cells.end() && isGround(*above) && above->z <= top + 1; ++above) {
      top = above->z;
      view.ground_class = above->label;
    }
    view.ground = static_cast<float>((top + 1) * resolution);
    view.clearance = std::numeric_limits<float>::infinity();
    view.occupancy = ColumnView::Occupancy::kFree;
  } else {
    above = cells.begin();
  }
  const bool from_ground = rules.reference == HeightReference::kGround;
  for (auto cell = cells.begin(); cell != cells.end(); ++cell) {
    const bool is_above = cell >= above;
    const double height = (cell->z + 0.5) * resolution - (from_ground && grounded ? view.ground : 0.0);
    const bool within = height >= rules.min_z && height <= rules.max_z;
    if (cell->state == VoxelState::kOccluded && is_above) view.occluded += static_cast<float>(resolution);
    if (cell->state == VoxelState::kFree && within) {
      view.occupancy = std::max(view.occupancy, ColumnView::Occupancy::kFree);
    }
    if (cell->state != VoxelState::kOccupied || classes.find(cell->label)->ignored) continue;
    if (grounded && is_above && std::isinf(view.clearance)) {
      view.clearance = static_cast<float>(cell->z * resolution) - view.ground;
    }
    if (grounded && cell->z == bottom - 1) continue;  // hits on what stood there reach as far as this
    if (!isGround(*cell) && (within || (from_ground && !grounded))) {
      view.occupancy = ColumnView::Occupancy::kOccupied;
    }
  }
  const bool graded = grounded && view.occupancy == ColumnView::Occupancy::kFree;
  view.cost = static_cast<std::int8_t>(graded ? classes.find(view.ground_class)->cost
                                              : static_cast<int>(view.occupancy));
  return view;
}

}  // namespace

std::set<ColumnMap::StackIndex> ColumnMap::update(const SemanticMap& map, const StateRules& rules,
                                                  const ClassTable& classes,
                                                  const std::vector<GridIndex>& changed) {
  std::set<StackIndex> stacks;
  for (const GridIndex& index : withDependents(map, rules, {changed.data(), changed.size()})) {
    const StackIndex stack(index.x, index.y);
    stacks.insert(stack);
    if (map.find({index})) {
      blocks_[stack].insert(index.z);
    } else {
      blocks_[stack].erase(index.z);
    }
  }
  std::array<Cells, kBlockEdge * kBlockEdge> cells;
  BlockView view;
  for (const StackIndex& stack : stacks) {
    const auto blocks = blocks_.find(stack);
    if (blocks->second.empty()) {
      blocks_.erase(blocks);
      columns_.erase(stack);
      continue;
    }
    for (Cells& column : cells) column.clear();
    for (const std::int32_t z : blocks->second) {
      const BlockIndex index{{stack.first, stack.second, z}};
      const Block* const block = map.find(index);
      if (!block) continue;  // erased, but not among the changed blocks
      readBlock(map, rules, index, *block, BlockFields::kStates, view);
      for (std::size_t v = 0; v < kBlockVoxels; ++v) {
        if (view.state[v] == VoxelState::kUnknown) continue;
        const auto layer = static_cast<std::int32_t>(v / cells.size());
        cells[v % cells.size()].push_back({z * kBlockEdge + layer, view.state[v], view.label[v]});
      }
    }
    Columns& columns = columns_[stack];
    for (std::size_t c = 0; c < cells.size(); ++c) {
      columns[c] = viewColumn(cells[c], classes, rules_, map.geometry().resolution());
    }
  }
  return stacks;
}

std::set<ColumnMap::StackIndex> ColumnMap::update(const SemanticMap& map, const StateRules& rules,
                                                  const ClassTable& classes) {
  std::vector<GridIndex> blocks;
  for (const auto& entry : map.entries()) blocks.push_back(entry.index);
  return update(map, rules, classes, blocks);
}

const ColumnView* ColumnMap::find(const VoxelIndex& voxel) const {
  const BlockIndex block = GridGeometry::blockOf(voxel);
  const auto stack = columns_.find({block.x, block.y});
  if (stack == columns_.end()) return nullptr;
  return &stack->second[static_cast<std::size_t>(GridGeometry::offsetInBlock(voxel)) % stack->second.size()];
}

}  // namespace bki_mapping
