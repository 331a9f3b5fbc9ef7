#include "evaluation/octomap_mapper.h"

#include <octomap/OcTree.h>

#include <map>
#include <sstream>
#include <stdexcept>

namespace bki_mapping {
namespace {

std::vector<NamedParameter<OctomapSettings>> octomapParameters() {
  using C = OctomapSettings;
  const NumberRange probability = NumberRange::above(0.0).upTo(1.0 - 1e-6);
  const auto real = [](const char* name, double C::*field, const NumberRange& range, const char* unit = "") {
    return realParameter(name, field, range, unit, Changes::kAtStart, "");
  };
  const auto truth = [](const char* name, bool C::*field) {
    return truthParameter(name, field, Changes::kAtStart, "");
  };
  return {
      real("max_range", &C::max_range, NumberRange::above(0.0).orElse(-1.0, "no limit"), "m"),
      real("hit", &C::hit, NumberRange::above(0.5).upTo(1.0 - 1e-6)),
      real("miss", &C::miss, NumberRange::above(0.0).upTo(0.5 - 1e-6)),
      real("min", &C::min, probability),
      real("max", &C::max, probability),
      real("threshold", &C::threshold, probability),
      truth("discretize", &C::discretize),
      truth("rays", &C::rays),
      truth("lazy", &C::lazy),
      truth("compress_map", &C::compress_map),
  };
}

constexpr int kKeyOfZero = 1 << 15;

octomap::OcTreeKey keyOf(const VoxelIndex& voxel) {
  const auto key = [](int coordinate) { return static_cast<octomap::key_type>(coordinate + kKeyOfZero); };
  return {key(voxel.x), key(voxel.y), key(voxel.z)};
}

octomap::point3d pointOf(const Eigen::Vector3d& point) {
  const Eigen::Vector3f p = point.cast<float>();
  return {p.x(), p.y(), p.z()};
}

}  // namespace

OctomapSettings octomapSettings(const std::string& text) {
  OctomapSettings settings;
  if (text == "default") return settings;
  std::map<std::string, std::string> values;
  std::istringstream in(text);
  for (std::string setting; std::getline(in, setting, ',');) {
    const std::size_t equals = setting.find('=');
    if (equals == std::string::npos) {
      throw std::invalid_argument("OctoMap's setting '" + shortText(setting) +
                                  "' has no '='; give default, or NAME=VALUE,...");
    }
    if (!values.emplace(setting.substr(0, equals), setting.substr(equals + 1)).second)
      throw std::invalid_argument("OctoMap's setting " + shortText(setting.substr(0, equals)) +
                                  " is given twice");
  }
  if (values.empty()) throw std::invalid_argument("OctoMap has no settings; give default, or NAME=VALUE,...");
  setNamedParameters(octomapParameters(), settings, values);
  if (settings.min >= settings.max)
    throw std::invalid_argument("OctoMap's min must be below its max, the limits of its probabilities");
  if (settings.rays && (settings.discretize || settings.max_range > 0.0))
    throw std::invalid_argument("OctoMap ignores max_range and discretize with rays=true; leave them out");
  return settings;
}

struct OctomapMapper::Tree {
  Tree(double resolution, const OctomapSettings& given) : octree(resolution), settings(given) {
    octree.setProbHit(settings.hit);
    octree.setProbMiss(settings.miss);
    octree.setClampingThresMin(settings.min);
    octree.setClampingThresMax(settings.max);
    octree.setOccupancyThres(settings.threshold);
  }

  Occupant occupantOf(const octomap::OcTreeNode& node) const {
    const bool occupied = octree.isNodeOccupied(node);
    return {occupied ? VoxelState::kOccupied : VoxelState::kFree, kFreeClass, node.getOccupancy()};
  }

  octomap::OcTree octree;
  OctomapSettings settings;
};

OctomapMapper::OctomapMapper(double resolution, const OctomapSettings& settings)
    : tree_(std::make_unique<Tree>(resolution, settings)) {}

OctomapMapper::~OctomapMapper() = default;

ScanTime OctomapMapper::integrate(const Scan& scan) {
  octomap::Pointcloud cloud;
  cloud.reserve(scan.points.size());
  for (const Eigen::Vector3f& point : scan.points) {
    if (point.allFinite()) cloud.push_back(pointOf(scan.origin + point.cast<double>()));
  }
  const octomap::point3d origin = pointOf(scan.origin);
  const OctomapSettings& settings = tree_->settings;
  octomap::OcTree& octree = tree_->octree;
  ScanTimer timer;
  if (settings.rays) {
    octree.insertPointCloudRays(cloud, origin, -1.0, settings.lazy);
  } else {
    octree.insertPointCloud(cloud, origin, settings.max_range, settings.lazy, settings.discretize);
  }
  if (settings.compress_map) octree.prune();
  return timer.elapsed();
}

std::optional<ClassId> OctomapMapper::at(const VoxelIndex& voxel) {
  const octomap::OcTreeNode* const node = tree_->octree.search(keyOf(voxel));
  if (!node || !tree_->octree.isNodeOccupied(node)) return std::nullopt;
  return kFreeClass;
}

Occupant OctomapMapper::occupantOf(const VoxelIndex& voxel) const {
  const octomap::OcTreeNode* const node = tree_->octree.search(keyOf(voxel));
  return node ? tree_->occupantOf(*node) : Occupant{};
}

void OctomapMapper::forEachKnown(const Visit& visit) const {
  const octomap::OcTree& octree = tree_->octree;
  for (auto leaf = octree.begin_leafs(), end = octree.end_leafs(); leaf != end; ++leaf) {
    const Occupant occupant = tree_->occupantOf(*leaf);
    const octomap::OcTreeKey first = leaf.getIndexKey();  // of the corner of a pruned leaf
    const int edge = 1 << (octree.getTreeDepth() - leaf.getDepth());
    for (int x = 0; x < edge; ++x) {
      for (int y = 0; y < edge; ++y) {
        for (int z = 0; z < edge; ++z) {
          visit({first[0] + x - kKeyOfZero, first[1] + y - kKeyOfZero, first[2] + z - kKeyOfZero}, occupant);
        }
      }
    }
  }
}

std::size_t OctomapMapper::bytes() const {
  return tree_->octree.memoryUsage();
}

}  // namespace bki_mapping
