#include "bki_mapping/map/map_query.h"

#include <algorithm>
#include <cmath>

namespace bki_mapping {
namespace {

double plogp(double p) {
  return p > 0.0 ? p * std::log(p) : 0.0;
}

}  // namespace

VoxelView viewWithoutEntropy(const SemanticMap& map, const Block& block, int offset) {
  VoxelView view;
  double total = 0.0;
  float best = 0.0f, free = 0.0f;
  const auto& classes = block.classes();
  for (std::size_t i = 0; i < classes.size(); ++i) {
    const float e = evidenceOf(block.plane(i)[offset]);
    total += e;
    if (classes[i] == kFreeClass) {
      free = e;
    } else if (e > best || (e == best && e > 0.0f && classes[i] < view.label)) {
      best = e;
      view.label = classes[i];
    }
  }
  view.evidence = static_cast<float>(total);
  if (total > 0.0) {
    view.state = best >= map.freeGain(view.label, best) * free ? VoxelState::kOccupied : VoxelState::kFree;
  } else if (block.occlusion()[static_cast<std::size_t>(offset)]) {
    view.state = VoxelState::kOccluded;
  }
  if (view.state != VoxelState::kOccupied) view.label = kFreeClass;

  const double sum = total + map.priorSum();
  const double p = (map.prior() + (view.state == VoxelState::kOccupied ? best : free)) / sum;
  view.probability = static_cast<float>(p);
  view.variance = static_cast<float>(p * (1.0 - p) / (sum + 1.0));
  view.occupancy = static_cast<float>(1.0 - (map.prior() + free) / sum);
  return view;
}

VoxelView viewVoxel(const SemanticMap& map, const Block& block, int offset) {
  VoxelView view = viewWithoutEntropy(map, block, offset);
  const auto& classes = block.classes();
  double total = 0.0;
  for (std::size_t i = 0; i < classes.size(); ++i)
    total += static_cast<double>(evidenceOf(block.plane(i)[offset]));
  const double sum = total + map.priorSum();
  double entropy = 0.0;
  for (std::size_t i = 0; i < classes.size(); ++i) {
    entropy -= plogp((map.prior() + static_cast<double>(evidenceOf(block.plane(i)[offset]))) / sum);
  }
  entropy -= static_cast<double>(map.classCount() + 1 - classes.size()) * plogp(map.prior() / sum);
  view.entropy = static_cast<float>(entropy);
  return view;
}

VoxelView viewWithoutEntropy(const SemanticMap& map, const VoxelIndex& voxel) {
  const Block* block = map.find(GridGeometry::blockOf(voxel));
  return block ? viewWithoutEntropy(map, *block, GridGeometry::offsetInBlock(voxel)) : VoxelView();
}

VoxelView viewPoint(const SemanticMap& map, const Eigen::Vector3d& point) {
  const VoxelIndex voxel = map.geometry().voxelAt(point);
  const Block* block = map.find(GridGeometry::blockOf(voxel));
  const int offset = GridGeometry::offsetInBlock(voxel);
  return block ? viewVoxel(map, *block, offset) : viewVoxel(map, Block(), offset);
}

std::vector<std::pair<BlockIndex, const Block*>> sortedBlocks(const SemanticMap& map) {
  std::vector<std::pair<BlockIndex, const Block*>> blocks;
  blocks.reserve(map.size());
  for (const auto& entry : map.entries()) blocks.emplace_back(entry.index, entry.block.get());
  std::sort(blocks.begin(), blocks.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  return blocks;
}

}  // namespace bki_mapping
