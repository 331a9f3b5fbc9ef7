#include "bki_mapping/inference/downsample.h"

#include "bki_mapping/core/grid_geometry.h"
#include "bki_mapping/inference/index_numbering.h"

namespace bki_mapping {
namespace {

constexpr std::uint32_t kEnd = 0xffffffffu;

/// Votes of one cell for one label; `next` chains the labels of a cell.
struct Votes {
  ClassId label;
  std::uint32_t count;
  std::uint32_t next;
};

struct Cell {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  std::uint32_t count = 0;
  std::uint32_t votes = kEnd;
};

void vote(Cell& cell, ClassId label, std::vector<Votes>& votes) {
  for (std::uint32_t v = cell.votes; v != kEnd; v = votes[v].next) {
    if (votes[v].label == label) {
      ++votes[v].count;
      return;
    }
  }
  votes.push_back({label, 1, cell.votes});
  cell.votes = static_cast<std::uint32_t>(votes.size() - 1);
}

ClassId majority(const Cell& cell, const std::vector<Votes>& votes) {
  Votes best{0, 0, kEnd};
  for (std::uint32_t v = cell.votes; v != kEnd; v = votes[v].next) {
    const bool wins =
        votes[v].count > best.count || (votes[v].count == best.count && votes[v].label < best.label);
    if (wins) best = votes[v];
  }
  return best.label;
}

}  // namespace

LabelledPoints downsample(const Eigen::Vector3d& origin, const LabelledPoints& input, double cell_size) {
  if (cell_size == 0.0) return input;
  const GridGeometry grid(cell_size);
  IndexNumbering numbering;
  std::vector<Cell> cells;
  std::vector<Votes> votes;
  for (std::size_t i = 0; i < input.points.size(); ++i) {
    const Eigen::Vector3d offset = input.points[i].cast<double>();
    const std::uint32_t number = numbering.insert(grid.voxelAt(origin + offset));
    if (number == cells.size()) cells.emplace_back();
    Cell& cell = cells[number];
    cell.sum += offset;
    ++cell.count;
    vote(cell, input.labels[i], votes);
  }
  LabelledPoints output;
  output.points.reserve(cells.size());
  output.labels.reserve(cells.size());
  for (const Cell& cell : cells) {
    output.points.push_back((cell.sum / cell.count).cast<float>());
    output.labels.push_back(majority(cell, votes));
  }
  return output;
}

}  // namespace bki_mapping
