#include "bki_mapping/free_space/beam_samples.h"
#include "bki_mapping/free_space/modes.h"

namespace bki_mapping {
namespace {

/// A sample at every multiple of the gap before the end of a beam.
class EvenSamples : public FreeSpaceModel {
 public:
  explicit EvenSamples(const MapperConfig& config) : config_(config) {}

  FreeSpaceEvidence observe(LazyBeamField& beams, std::uint64_t) const override {
    return sampleBeams(config_, beams.beams(), [this](std::size_t, double length, auto&& add) {
      for (int n = 1; n * config_.free_space.gap < length; ++n) add(n * config_.free_space.gap);
    });
  }

 private:
  MapperConfig config_;
};

}  // namespace

std::unique_ptr<FreeSpaceModel> makeEvenSamples(const MapperConfig& config) {
  return std::make_unique<EvenSamples>(config);
}

}  // namespace bki_mapping
