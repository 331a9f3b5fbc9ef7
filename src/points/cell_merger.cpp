#include "points/cell_merger.h"

namespace bki_mapping {

void CellMerger::voteForOther(Cell& cell, ClassId label) {
  for (std::uint32_t v = cell.more; v != kNoPosition; v = votes_[v].next) {
    if (votes_[v].label == label) {
      ++votes_[v].count;
      return;
    }
  }
  votes_.push_back({label, 1, cell.more});
  cell.more = static_cast<std::uint32_t>(votes_.size() - 1);
}

ClassId CellMerger::majority(const Cell& cell) const {
  ClassId label = cell.label;
  std::uint32_t most = cell.votes;
  for (std::uint32_t v = cell.more; v != kNoPosition; v = votes_[v].next) {
    if (votes_[v].count > most || (votes_[v].count == most && votes_[v].label < label)) {
      most = votes_[v].count;
      label = votes_[v].label;
    }
  }
  return label;
}

void CellMerger::finishTile(MergedPoints& output) {
  const std::size_t before = output.size();
  output.resize(before + count_);
  for (std::uint32_t c = 0; c < count_; ++c) {
    const Cell& cell = cells_[c];
    slots_[cell.offset] = kEmpty;
    const double scale = 1.0 / cell.count;
    output.x[before + c] = static_cast<float>(cell.x * scale);
    output.y[before + c] = static_cast<float>(cell.y * scale);
    output.z[before + c] = static_cast<float>(cell.z * scale);
    output.labels[before + c] = cell.more == kNoPosition ? cell.label : majority(cell);
  }
  count_ = 0;
  votes_.clear();
}

void CellMerger::reserveAs(const CellMerger& other) {
  startTile(other.cells_.size());
  votes_.reserve(other.votes_.capacity());
}

}  // namespace bki_mapping
