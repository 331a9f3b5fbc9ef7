/// @file Choices of the settings that concern beams.
#pragma once

namespace bki_mapping {

enum class BeamWeight { kUniform, kLinear, kBilinear };
enum class FreeSpaceExtent { kMapped, kObserved };
enum class BeamIndexType { kTable, kRtree };
enum class OcclusionExtent { kNone, kMapped, kAll };

}  // namespace bki_mapping
