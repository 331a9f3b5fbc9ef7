#include "bki_mapping/map/map_query.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "map/calibration.h"
#include "map/view_kernels.h"

namespace bki_mapping {
namespace {

constexpr EvidenceUnits kNoEvidence[kBlockVoxels] = {};

BlockPlanes planesOf(const SemanticMap& map, const Block& block) {
  BlockPlanes planes;
  planes.map = &map;
  planes.free = kNoEvidence;
  for (std::size_t p = 0; p < block.classes().size(); ++p) {
    const ClassId id = block.classes()[p];
    if (id == kFreeClass) {
      planes.free = block.plane(p);
      planes.has_free = true;
      continue;
    }
    const float gain = map.freeGain(id, 0.0f);
    const bool decays = gain > 1.0f && map.freeGain(id, std::numeric_limits<float>::infinity()) != gain;
    planes.planes[planes.count++] = {block.plane(p), id, gain, decays, map.isFixed(id)};
  }
  return planes;
}

/// - p log(p), accurate for p near 1, too. @param others sum of the other concentrations.
double entropyTerm(double alpha, double others) {
  return alpha / (alpha + others) * std::log1p(others / alpha);
}

/// Equation 13: the probability that something is in a voxel. @param best evidence of the likeliest class.
double occupancyOf(double prior, double best, double gain, double free) {
  const double something = kPriorOfSomething * prior + best;
  const double nothing =
      kPriorOfNothing * prior + kBesideSurfaces * something + kWeightOfFree * std::max(gain, 1.0) * free;
  return something / (something + nothing);
}

/// Sum of (alpha_k / alpha)^2 over all classes k.
double squaredRatios(const SemanticMap& map, const Block& block, int offset, double alpha) {
  constexpr double kUnit = kEvidenceUnit;
  const auto square = [](double ratio) { return ratio * ratio; };
  double sum = static_cast<double>(map.classCount()) * square(map.prior() / alpha);
  for (std::size_t i = 0; i < block.classes().size(); ++i) {
    const double evidence = kUnit * std::max(block.plane(i)[offset], 0);
    if (block.classes()[i] == kFreeClass || evidence == 0.0) continue;
    sum += square((map.prior() + evidence) / alpha) - square(map.prior() / alpha);
  }
  return sum;
}

}  // namespace

bool isOccupied(EvidenceUnits best, float gain, EvidenceUnits free) {
  return best >= static_cast<double>(gain) * free;
}

float decayedGain(const SemanticMap& map, ClassId id, float hits) {
  return map.freeGain(id, hits);
}

void readBlock(const ViewKernels& kernels, const SemanticMap& map, const Block& block, BlockFields fields,
               BlockView& view) {
  const auto read = fields == BlockFields::kStates          ? kernels.states
                    : fields == BlockFields::kAllButEntropy ? kernels.posterior
                                                            : kernels.all;
  read(planesOf(map, block), view);
  const Block::Occlusion& marks = block.occlusion();
  if (marks.none()) return;
  for (std::size_t v = 0; v < kBlockVoxels; ++v) {
    if (marks[v] && view.state[v] == VoxelState::kUnknown) view.state[v] = VoxelState::kOccluded;
  }
}

void readBlock(const SemanticMap& map, const Block& block, BlockFields fields, BlockView& view) {
  static const ViewKernels* const fastest = &viewKernelsFor("");
  readBlock(*fastest, map, block, fields, view);
}

VoxelView viewWithoutEntropy(const SemanticMap& map, const Block& block, int offset) {
  // Units are whole numbers, of which doubles hold the sum over all classes exactly.
  EvidenceUnits best_units = 0, free_units = 0, fixed_units = 0;
  ClassId fixed = kFreeClass;  // the likeliest of the classes that cannot move
  double units_of_classes = 0.0;
  VoxelView view;
  const auto& classes = block.classes();
  for (std::size_t i = 0; i < classes.size(); ++i) {
    const EvidenceUnits units = std::max(block.plane(i)[offset], 0);
    if (classes[i] == kFreeClass) {
      free_units = units;
      continue;
    }
    units_of_classes += units;
    if (units > best_units) {  // of equal evidence, the first class has the smaller id
      best_units = units;
      view.label = classes[i];
    }
    if (units > fixed_units && map.isFixed(classes[i])) {
      fixed_units = units;
      fixed = classes[i];
    }
  }
  constexpr double kUnit = kEvidenceUnit;
  const double free = kUnit * free_units, of_classes = kUnit * units_of_classes;
  float gain = map.freeGain(view.label, static_cast<float>(kUnit * best_units));
  bool holds = isOccupied(best_units, gain, free_units);
  if (!holds && map.remainingGain() > 0.0f && fixed != view.label &&
      fixed_units > (best_units - 1) >> kRemainingShift &&
      isOccupied(fixed_units, map.remainingGain(), free_units)) {
    holds = true;
    best_units = fixed_units;
    view.label = fixed;
    gain = map.remainingGain();
  }
  const double best = kUnit * best_units;
  if (best_units > 0 || free_units > 0) {
    view.state = holds ? VoxelState::kOccupied : VoxelState::kFree;
  } else if (block.occlusion()[static_cast<std::size_t>(offset)]) {
    view.state = VoxelState::kOccluded;
  }
  const bool occupied = view.state == VoxelState::kOccupied;
  if (!occupied) view.label = kFreeClass;

  // Equations 10 and 13.
  const double prior = map.prior(), prior_of_classes = prior * static_cast<double>(map.classCount());
  const double own = occupied ? best : free, alpha = prior + own;
  const double others = prior_of_classes + (of_classes + free - own), sum = alpha + others;
  view.evidence = static_cast<float>(of_classes + free);
  view.probability = static_cast<float>(alpha / sum);
  view.variance = static_cast<float>(alpha / sum * (others / sum) / (sum + 1.0));
  view.occupancy = static_cast<float>(occupancyOf(prior, best, static_cast<double>(gain), free));
  view.class_probability = static_cast<float>(1.0 / squaredRatios(map, block, offset, prior + best));
  return view;
}

VoxelView viewVoxel(const SemanticMap& map, const Block& block, int offset) {
  VoxelView view = viewWithoutEntropy(map, block, offset);
  const auto classes = block.classes().size(), all = map.classCount() + 1;
  double total = 0.0;
  for (std::size_t i = 0; i < classes; ++i) total += std::max(block.plane(i)[offset], 0);
  const auto term = [&](double units) {
    constexpr double kUnit = kEvidenceUnit;
    const double others = map.prior() * static_cast<double>(all - 1) + kUnit * (total - units);
    return entropyTerm(map.prior() + kUnit * units, others);
  };
  double entropy = static_cast<double>(all - classes) * term(0.0);
  for (std::size_t i = 0; i < classes; ++i) entropy += term(std::max(block.plane(i)[offset], 0));
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
  for (const auto& [index, block] : map.entries()) blocks.emplace_back(index, block);
  std::sort(blocks.begin(), blocks.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  return blocks;
}

}  // namespace bki_mapping
