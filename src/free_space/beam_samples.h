/// @file Free space as points sampled along beams.
#pragma once

#include <cmath>

#include "free_space/free_space_model.h"
#include "parallel/chunks.h"
#include "points/downsample.h"
#include "points/point_evidence.h"

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

/// Evidence of points on each beam, down-sampled like hits.
class BeamSamples {
 public:
  explicit BeamSamples(const FreeSpaceSetup& setup)
      : downsampler_(setup.downsample_resolution, setup.geometry.blockSize()),
        evidence_(setup.geometry, setup.kernel) {}

  /// A scan may take this many samples; each takes some 50 bytes of working memory.
  static constexpr double kMost = 1 << 25;
  /// So may a beam: a hundred times what a beam of 300 m takes at a gap of 0.1 m.
  static constexpr double kMostOfBeam = 1 << 18;
  /// @param samples of a scan, and of its longest beam. @throws TooMuchWork if these are too many.
  static void limit(double samples, double of_longest) {
    if (samples > kMost || of_longest > kMostOfBeam) throw TooMuchWork(TooMuchWork::What::kSamples, samples);
  }

  /// @param forEachDistance called as forEachDistance(beam number, length [m], add) shall call add(distance
  /// [m]) for each sample, 0 <= distance < length; from several threads at once.
  template <typename ForEachDistance>
  FreeSpaceEvidence sample(const Beams& beams, ThreadPool& pool, ForEachDistance&& forEachDistance) {
    const Chunks chunks(beams.ends.size());
    downsampler_.start(beams.origin, chunks.count(), pool, false);
    pool.forEach(chunks.count(), [&](std::size_t c, std::size_t worker) {
      Downsampler::Input& samples = downsampler_.open(c, worker);
      for (std::size_t b = chunks.begin(c); b < chunks.end(c); ++b) {
        const Eigen::Vector3d end = beams.ends[b].cast<double>();
        const double length = end.norm();
        const Eigen::Vector3d direction = end / length;
        forEachDistance(b, length, [&](double distance) {
          samples.add((direction * distance).cast<float>(), kFreeClass);
        });
      }
      downsampler_.close(c, worker);
    });
    downsampler_.finish(pool);
    evidence_.setPoints(beams.origin, downsampler_, pool);
    return {&evidence_, evidence_.size()};
  }

 private:
  Downsampler downsampler_;
  PointEvidence evidence_;
};

}  // namespace bki_mapping
