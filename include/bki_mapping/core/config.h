/// @file Every setting of the mapper with its default; parameters.h gives them names.
#pragma once

#include <cstdint>
#include <string>

namespace bki_mapping {

enum class KernelType { kSparse, kCounting };
struct KernelConfig {
  KernelType type = KernelType::kSparse;
  double length = 0.0;  ///< support radius l [m]; 0: as long as the resolution
  double scale = 0.1;   ///< sigma0, the kernel's value at distance 0

  /// The support radius in force [m]. @param resolution edge of a voxel [m].
  double lengthFor(double resolution) const { return length > 0.0 ? length : resolution; }
};

enum class BeamWeight { kUniform, kLinear, kBilinear };
enum class FreeSpaceExtent { kMapped, kObserved };
enum class BeamIndexType { kTable, kRtree };
struct FreeSpaceConfig {
  std::string mode = "line";                            ///< a name of the registry in free_space/registry.h
  double gap = 1.0;                                     ///< mode even: distance between samples of a beam [m]
  int samples_per_beam = 1;                             ///< modes uniform and linear
  std::int64_t seed = 1;                                ///< modes uniform and linear
  BeamWeight weight = BeamWeight::kBilinear;            ///< mode line
  FreeSpaceExtent extent = FreeSpaceExtent::kObserved;  ///< mode line
  BeamIndexType beam_index = BeamIndexType::kTable;     ///< mode line, and occlusion
  bool hits_before_misses = false;      ///< voxels that hold a hit are not cleared by its scan
  bool evidence_before_misses = false;  ///< nor are voxels that a hit's kernel reaches
};

/// Gains on the evidence for `free` when the state of a voxel is decided, by its likeliest class; 1 is the
/// posterior's own verdict. Voxels of the unlabelled class have 1.
struct FreeGainConfig {
  double dynamic_classes = 1.0;  ///< classes flagged dynamic
  double static_classes = 1.0;   ///< the others
  /// Evidence of hits over which a gain above 1 falls to 1/e of what it is above 1; 0: it does not.
  double persistence = 0.0;
};

/// What one scan may add at most to one voxel; 0: no limit.
struct ScanLimitConfig {
  double hits = 0.0;  ///< to all classes together; they share it in proportion
  double free = 0.0;
  /// Blocks that its hits, or its free space, may touch; 0: as many as lie within the sensor's reach, but no
  /// more than kMostBlocks. A scan beyond the limit is refused whole.
  std::int64_t blocks = 0;

  static constexpr std::int64_t kMostBlocks = 1 << 18;  ///< half a gigabyte for each class in all of them
};

struct SensorModelConfig {
  double min_range = 0.0;   ///< hits nearer than this are dropped [m]
  double max_range = -1.0;  ///< hits farther than this are no hits [m]; -1: not known

  /// Where a range is not known, points farther than this count as faults of the driver [m]: they neither
  /// occupy nor clear. Lidars see up to about 250 m; a corrupt point may lie anywhere.
  static constexpr double kFarthest = 300.0;
  bool knowsRange() const { return max_range > 0.0; }
  double reach() const { return knowsRange() ? max_range : kFarthest; }  ///< no hit is farther [m]
};

enum class OcclusionExtent { kNone, kMapped, kAll };
enum class UnlabelledPoints { kOccupied, kIgnore };
enum class UnknownLabels { kIgnore, kUnlabelled };
enum class LabelValues { kRaw, kId };

struct MapperConfig {
  double resolution = 0.3;             ///< edge of a voxel [m]
  double prior = 0.001;                ///< alpha0, concentration of each class before any scan
  double downsample_resolution = 0.1;  ///< edge of a down-sampling cell [m]; 0: off
  int threads = 0;                     ///< 0: all cores
  double memory_limit = 0.0;           ///< of the map [MB]; 0: none. A scan that would exceed it is refused
  KernelConfig kernel;
  FreeSpaceConfig free_space;
  FreeGainConfig free_gain;
  ScanLimitConfig scan_limit;
  SensorModelConfig sensor_model;
  bool clear_beyond_max_range = true;  ///< hits beyond max_range clear as beams cut there
  OcclusionExtent occlusion = OcclusionExtent::kNone;
  UnlabelledPoints unlabelled_points = UnlabelledPoints::kOccupied;
  UnknownLabels unknown_labels = UnknownLabels::kIgnore;
  LabelValues label_values = LabelValues::kRaw;
};

}  // namespace bki_mapping
