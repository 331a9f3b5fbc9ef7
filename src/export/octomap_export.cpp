#include "export/octomap_export.h"

#include <octomap/ColorOcTree.h>
#include <octomap/OcTree.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "bki_mapping/rules/voxel_state.h"
#include "core/atomic_file.h"

namespace bki_mapping {
namespace {

constexpr int kKeyOfZero = 1 << 15;

octomap::OcTreeKey keyOf(const VoxelIndex& voxel) {
  const auto key = [](std::int32_t coordinate) -> octomap::key_type {
    if (coordinate < -kKeyOfZero || coordinate >= kKeyOfZero) {
      throw std::invalid_argument("the map has a voxel " + std::to_string(coordinate) +
                                  " voxels from its origin along an axis, and an OctoMap can hold 32,768; "
                                  "clear what lies far away with clear_map, use a coarser resolution, or "
                                  "move the map to a local frame with merge_maps --transform");
    }
    return static_cast<octomap::key_type>(coordinate + kKeyOfZero);
  };
  return {key(voxel.x), key(voxel.y), key(voxel.z)};
}

/// Calls add(key, view) for each voxel that is occupied or free.
template <typename Add>
void forEachLeaf(const SemanticMap& map, const StateRules& rules, Add&& add) {
  forEachKnownVoxel(map, rules, [&](const VoxelIndex& voxel, const VoxelView& view) {
    if (view.state != VoxelState::kOccluded) add(keyOf(voxel), view);
  });
}

/// The log-odds that something is in a voxel. Their sign decides the state for OctoMap, which takes 0 for
/// occupied.
float logOdds(const VoxelView& view) {
  constexpr double kLeast = 0.01;
  const double odds = view.occupancy / std::max(1.0 - view.occupancy, 1e-30);
  const double log_odds = std::log(std::max(odds, 1e-30));
  return static_cast<float>(view.state == VoxelState::kOccupied ? std::max(log_odds, kLeast)
                                                                : std::min(log_odds, -kLeast));
}

/// Merges leaves with the same value and colour; OctoMap's own pruning mixes colours.
/// @return whether the node is a leaf then.
bool prune(octomap::ColorOcTree& tree, octomap::ColorOcTreeNode* node) {
  if (!tree.nodeHasChildren(node)) return true;
  bool same = true;
  const octomap::ColorOcTreeNode* first = nullptr;
  for (unsigned i = 0; i < 8; ++i) {
    if (!tree.nodeChildExists(node, i)) {
      same = false;
      continue;
    }
    octomap::ColorOcTreeNode* const child = tree.getNodeChild(node, i);
    const bool is_leaf = prune(tree, child);
    if (!first) first = child;
    same =
        same && is_leaf && child->getValue() == first->getValue() && child->getColor() == first->getColor();
  }
  return same && tree.pruneNode(node);
}

std::string binaryTree(const SemanticMap& map, const StateRules& rules, std::ostringstream& out) {
  octomap::OcTree tree(map.geometry().resolution());
  forEachLeaf(map, rules, [&](const octomap::OcTreeKey& key, const VoxelView& view) {
    const bool occupied = view.state == VoxelState::kOccupied;
    tree.setNodeValue(key, occupied ? tree.getClampingThresMaxLog() : tree.getClampingThresMinLog(), true);
  });
  tree.updateInnerOccupancy();
  tree.prune();
  // The same as writeBinaryConst(), which also prints to standard error.
  out << "# Octomap OcTree binary file\nid " << tree.getTreeType() << "\nsize " << tree.size() << "\nres "
      << tree.getResolution() << "\ndata\n";
  tree.writeBinaryData(out);
  return out.str();
}

std::string colorTree(const SemanticMap& map, const StateRules& rules, const ClassTable& classes,
                      std::ostringstream& out) {
  octomap::ColorOcTree tree(map.geometry().resolution());
  forEachLeaf(map, rules, [&](const octomap::OcTreeKey& key, const VoxelView& view) {
    octomap::ColorOcTreeNode* const node = tree.setNodeValue(key, logOdds(view), true);
    const SemanticClass* const known = classes.find(view.label);
    if (known) node->setColor(known->color[0], known->color[1], known->color[2]);
  });
  if (tree.getRoot()) {
    prune(tree, tree.getRoot());
    tree.updateInnerOccupancy();
  }
  tree.write(out);
  return out.str();
}

}  // namespace

void exportOctoMap(const std::string& path, const SemanticMap& map, const StateRules& rules,
                   const ClassTable& classes) {
  const std::string ending = std::filesystem::path(path).extension().string();
  if (ending != ".bt" && ending != ".ot")
    throw std::invalid_argument("OctoMap '" + path + "' must end in .bt or .ot");
  AtomicFile file(path);
  std::ostringstream out;
  out.precision(
      std::numeric_limits<double>::max_digits10);  // of the resolution, which OctoMap writes as text
  file.write(ending == ".bt" ? binaryTree(map, rules, out) : colorTree(map, rules, classes, out));
  file.commit();
}

}  // namespace bki_mapping
