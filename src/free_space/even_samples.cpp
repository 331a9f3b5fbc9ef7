#include <algorithm>

#include "bki_mapping/free_space/beam_samples.h"
#include "bki_mapping/free_space/modes.h"

namespace bki_mapping {
namespace {

/// A sample at every multiple of the gap before the end of a beam.
class EvenSamples : public FreeSpaceModel {
 public:
  explicit EvenSamples(const MapperConfig& config) : gap_(config.free_space.gap), samples_(config) {}

  FreeSpaceEvidence observe(LazyBeamField& beams, std::uint64_t, Workers& workers) override {
    double metres = 0.0, longest = 0.0;
    for (const Eigen::Vector3f& end : beams.beams().ends) {
      const auto length = static_cast<double>(end.norm());
      metres += length;
      longest = std::max(longest, length);
    }
    BeamSamples::limit(metres / gap_, longest / gap_);
    return samples_.sample(beams.beams(), workers, [this](std::size_t, double length, auto&& add) {
      for (int n = 1; n * gap_ < length; ++n) add(n * gap_);
    });
  }

 private:
  double gap_;
  BeamSamples samples_;
};

}  // namespace

std::unique_ptr<FreeSpaceModel> makeEvenSamples(const MapperConfig& config) {
  return std::make_unique<EvenSamples>(config);
}

}  // namespace bki_mapping
