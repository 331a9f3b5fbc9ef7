/// @file Evidence for `free` at points sampled along beams.
#pragma once

#include "free_space/free_space_model.h"
#include "parallel/chunks.h"
#include "points/downsample.h"
#include "points/point_evidence.h"

namespace bki_mapping {

/// Turns samples on each beam into evidence; they are down-sampled like hits.
class BeamSamples {
 public:
  explicit BeamSamples(const FreeSpaceSetup& setup)
      : downsampler_(setup.downsample_resolution, setup.geometry.blockSize()),
        evidence_(setup.geometry, setup.kernel) {}

  /// Most samples of a scan; each takes about 50 bytes of working memory.
  static constexpr double kMost = 1 << 25;
  /// Most samples of a beam: about a hundred times those of a beam of 300 m at a gap of 0.1 m.
  static constexpr double kMostOfBeam = 1 << 18;
  /// @throws TooMuchWork if there are too many samples. @param samples of the scan. @param of_longest samples
  /// of its longest beam.
  static void limit(double samples, double of_longest) {
    if (samples > kMost || of_longest > kMostOfBeam) throw TooMuchWork(TooMuchWork::What::kSamples, samples);
  }

  /// @param forEachDistance called as forEachDistance(beam, length [m], add) for each beam, from several
  /// threads at once. It calls add(distance [m]) for each sample, with 0 <= distance < length.
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
    evidence_.setPoints(beams.origin, downsampler_.merged(), pool);
    return {&evidence_, evidence_.size()};
  }

 private:
  Downsampler downsampler_;
  PointEvidence evidence_;
};

}  // namespace bki_mapping
