#include <algorithm>

#include "free_space/beam_samples.h"
#include "free_space/free_space_model.h"

namespace bki_mapping {
namespace {

/// Mode `even`: equidistant samples, at every multiple of the gap up to the end of the beam.
class EvenSamples : public FreeSpaceModel {
 public:
  explicit EvenSamples(const FreeSpaceSetup& setup) : gap_(setup.config.gap), samples_(setup) {}

  FreeSpaceEvidence observe(LazyBeamField& beams, std::uint64_t, ThreadPool& pool) override {
    double metres = 0.0, longest = 0.0;
    for (const Eigen::Vector3f& end : beams.beams().ends) {
      const auto length = static_cast<double>(end.norm());
      metres += length;
      longest = std::max(longest, length);
    }
    BeamSamples::limit(metres / gap_, longest / gap_);
    return samples_.sample(beams.beams(), pool, [this](std::size_t, double length, auto&& add) {
      for (int n = 1; n * gap_ < length; ++n) add(n * gap_);
    });
  }

 private:
  double gap_;
  BeamSamples samples_;
};

}  // namespace

std::unique_ptr<FreeSpaceModel> makeEvenSamples(const FreeSpaceSetup& setup) {
  return std::make_unique<EvenSamples>(setup);
}

}  // namespace bki_mapping
