/// @file Free space as points sampled along beams.
#pragma once

#include <cmath>
#include <utility>

#include "bki_mapping/free_space/free_space_model.h"
#include "bki_mapping/inference/downsample.h"
#include "bki_mapping/inference/point_evidence.h"

namespace bki_mapping {

/// Distance from the sensor of a random sample, for u uniform on [0, 1) and a beam of length L [m].
inline double uniformDistance(double u, double length) {
  return u * length;
}
/// The density of distances grows as r, so that a plane of beams is covered evenly (Theorem 1 of Zhong and
/// Peng).
inline double linearDistance(double u, double length) {
  return std::sqrt(u) * length;
}

/// Evidence of the points at the given distances along each beam, down-sampled like hits.
/// @param forEachDistance called as forEachDistance(beam number, length [m], add) shall call add(distance
/// [m]) for each sample, 0 < distance < length.
template <typename ForEachDistance>
FreeSpaceEvidence sampleBeams(const MapperConfig& config, const Beams& beams,
                              ForEachDistance&& forEachDistance) {
  LabelledPoints samples;
  for (std::size_t b = 0; b < beams.ends.size(); ++b) {
    const Eigen::Vector3d end = beams.ends[b].cast<double>();
    const double length = end.norm();
    forEachDistance(b, length, [&](double distance) {
      samples.points.push_back((end * (distance / length)).cast<float>());
    });
  }
  samples.labels.assign(samples.points.size(), kFreeClass);
  samples = downsample(beams.origin, samples, config.downsample_resolution);
  const GridGeometry geometry(config.resolution);
  return {std::make_unique<PointEvidence>(geometry, config.kernel, beams.origin, samples),
          samples.points.size()};
}

}  // namespace bki_mapping
