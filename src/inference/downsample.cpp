#include "bki_mapping/inference/downsample.h"

#include <algorithm>

namespace bki_mapping {
namespace {

constexpr std::uint32_t kNone = 0xffffffffu;
constexpr std::uint32_t kPartitionBits = 6, kCellBits = 32 - kPartitionBits;

/// Cells of a cube of 8 x 8 x 8 share a partition, so that the neighbours of which a scan is made mostly do.
std::size_t partitionOf(const VoxelIndex& cell) {
  return GridIndexHash()(GridGeometry::blockOf(cell)) >> (64 - kPartitionBits);
}

/// A partition and a cell in it, in one number.
std::uint32_t codeOf(std::size_t partition, std::size_t cell) {
  return static_cast<std::uint32_t>(partition << kCellBits | cell);
}

}  // namespace

void Downsampler::start(const Eigen::Vector3d& origin, double cell, std::size_t chunks) {
  static_assert(kPartitions == 1u << kPartitionBits);
  origin_ = origin;
  cell_ = cell;
  grid_ = GridGeometry(cell > 0.0 ? cell : 1.0);
  used_ = chunks;
  if (chunks_.size() < chunks) chunks_.resize(chunks);
  for (std::size_t c = 0; c < used_; ++c) {
    for (auto& records : chunks_[c].records) records.clear();
    chunks_[c].cell_of.clear();
  }
}

void Downsampler::add(std::size_t chunk, const Eigen::Vector3f& point, ClassId label) {
  Chunk& into = chunks_[chunk];
  const VoxelIndex cell = grid_.voxelAt(origin_ + point.cast<double>());
  const std::size_t partition = partitionOf(cell);
  into.records[partition].push_back({point, cell, static_cast<std::uint32_t>(into.cell_of.size()), label});
  into.cell_of.push_back(kNone);
}

void Downsampler::vote(Cell& cell, ClassId label, std::vector<Votes>& votes) {
  if (label == cell.label) {
    ++cell.votes;
    return;
  }
  for (std::uint32_t v = cell.more; v != kNone; v = votes[v].next) {
    if (votes[v].label == label) {
      ++votes[v].count;
      return;
    }
  }
  votes.push_back({label, 1, cell.more});
  cell.more = static_cast<std::uint32_t>(votes.size() - 1);
}

ClassId Downsampler::majority(const Cell& cell, const std::vector<Votes>& votes) {
  ClassId label = cell.label;
  std::uint32_t most = cell.votes;
  for (std::uint32_t v = cell.more; v != kNone; v = votes[v].next) {
    if (votes[v].count > most || (votes[v].count == most && votes[v].label < label)) {
      most = votes[v].count;
      label = votes[v].label;
    }
  }
  return label;
}

std::uint32_t Downsampler::mergeRecord(const Record& record, Scratch& scratch) {
  const std::size_t mask = scratch.slots.size() - 1;
  std::size_t s = GridIndexHash()(record.cell) & mask;
  while (scratch.slots[s] != kNone && scratch.cells[scratch.slots[s]].index != record.cell)
    s = (s + 1) & mask;
  const Eigen::Vector3d point = record.point.cast<double>();
  if (scratch.slots[s] == kNone) {
    scratch.slots[s] = static_cast<std::uint32_t>(scratch.cells.size());
    scratch.cells.push_back({record.cell, point, 1, 1, kNone, record.label});
    return scratch.slots[s];
  }
  Cell& cell = scratch.cells[scratch.slots[s]];
  cell.sum += point;
  ++cell.count;
  vote(cell, record.label, scratch.votes);
  return kNone;
}

void Downsampler::merge(std::size_t p, Scratch& scratch) {
  merged_[p].clear();
  if (cell_ == 0.0) {  // each point is its own cell
    for (std::size_t c = 0; c < used_; ++c) {
      Chunk& chunk = chunks_[c];
      for (const Record& record : chunk.records[p]) {
        chunk.cell_of[record.place] = codeOf(p, merged_[p].size());
        merged_[p].push_back({record.point, record.label});
      }
    }
    return;
  }
  std::size_t records = 0, slots = 64;
  for (std::size_t c = 0; c < used_; ++c) records += chunks_[c].records[p].size();
  while (slots < 2 * records) slots *= 2;
  scratch.slots.assign(slots, kNone);
  scratch.cells.clear();
  scratch.votes.clear();
  for (std::size_t c = 0; c < used_; ++c) {
    Chunk& chunk = chunks_[c];
    for (const Record& record : chunk.records[p]) {
      const std::uint32_t cell = mergeRecord(record, scratch);
      if (cell != kNone) chunk.cell_of[record.place] = codeOf(p, cell);
    }
  }
  for (const Cell& cell : scratch.cells) {
    merged_[p].push_back({(cell.sum * (1.0 / cell.count)).cast<float>(), majority(cell, scratch.votes)});
  }
}

void Downsampler::write(const Chunk& chunk, LabelledPoints& output) const {
  std::size_t place = chunk.begin;
  for (const std::uint32_t code : chunk.cell_of) {
    if (code == kNone) continue;
    const Merged& merged = merged_[code >> kCellBits][code & ((1u << kCellBits) - 1)];
    output.points[place] = merged.point;
    output.labels[place++] = merged.label;
  }
}

void Downsampler::finish(Workers& workers) {
  scratch_.resize(workers.count());
  workers.forEach(kPartitions, [&](std::size_t p, std::size_t worker) { merge(p, scratch_[worker]); });
}

void Downsampler::finish(Workers& workers, LabelledPoints& output) {
  finish(workers);
  std::size_t cells = 0;
  for (std::size_t c = 0; c < used_; ++c) {
    const auto& cell_of = chunks_[c].cell_of;
    chunks_[c].begin = cells;
    cells += cell_of.size() - static_cast<std::size_t>(std::count(cell_of.begin(), cell_of.end(), kNone));
  }
  output.points.resize(cells);
  output.labels.resize(cells);
  workers.forEach(used_, [&](std::size_t c, std::size_t) { write(chunks_[c], output); });
}

}  // namespace bki_mapping
