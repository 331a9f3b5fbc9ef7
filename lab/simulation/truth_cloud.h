/// @file Clouds of which it is known what moves, as the DynamicMap benchmark has them
/// (Zhang et al., "A Dynamic Points Removal Benchmark in Point Cloud Maps", ITSC 2023).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bki_mapping/core/scan.h"

namespace bki_mapping {

/// A set of SemanticKITTI's raw labels.
class KittiLabels {
 public:
  KittiLabels(std::initializer_list<std::uint32_t> raw) : raw_(raw) {}
  /// Those of moving objects, 252 to 259.
  static KittiLabels moving();

  /// @param label as in its files, whose upper 16 bits are an instance, whatever the class table says.
  bool contains(std::uint32_t label) const { return raw_.count(label & 0xffffu) > 0; }

 private:
  std::set<std::uint32_t> raw_;
};

/// A cloud in the map frame of which it is known what moves.
struct TruthCloud {
  std::vector<Eigen::Vector3f> points;                         ///< relative to origin(); all finite [m]
  std::vector<std::uint8_t> moving;                            ///< whether each point is of a moving object
  std::size_t not_finite = 0;                                  ///< number of points left out
  std::optional<Eigen::Vector3d> fixed_origin = std::nullopt;  ///< once it is set [m]

  /// Adds a scan with raw labels of SemanticKITTI, as the benchmark makes its clouds from them: 252 to 259
  /// move, and so do points without a class (0, 1) within 3 m, which are of the car itself. Points 50 m away
  /// and farther are left out, because their labels are not reliable,
  /// and so is what simulated weather and panes add.
  void add(const Scan& scan);

  /// Sets the origin of the points if it is not yet set. @param near a place in the cloud [m].
  void setOrigin(const Eigen::Vector3d& near);
  /// That of the map frame or, far from it, a place near the first scan, so that float32 is precise [m].
  Eigen::Vector3d origin() const { return fixed_origin.value_or(Eigen::Vector3d::Zero()); }
  /// A point of a scan, relative to the origin.
  Eigen::Vector3f relative(const Scan& scan, std::size_t i) const;
};

/// Reads a cloud whose field `label` or, if it has none, `intensity` is 1 for points of moving objects and 0
/// for others. @throws std::runtime_error in one sentence if the file or a value is wrong.
TruthCloud readTruthCloud(const std::string& path);
/// Writes such a cloud, with the field `intensity`. @throws std::runtime_error if that fails.
void writeTruthCloud(const std::string& path, const TruthCloud& cloud);

}  // namespace bki_mapping
