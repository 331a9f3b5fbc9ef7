#include "bki_mapping/free_space/beam_samples.h"
#include "bki_mapping/free_space/modes.h"
#include "bki_mapping/inference/counter_random.h"

namespace bki_mapping {
namespace {

/// A fixed number of random samples a beam; `Distance` maps (u, length) to the distance from the sensor.
template <double (*Distance)(double, double)>
class RandomSamples : public FreeSpaceModel {
 public:
  explicit RandomSamples(const MapperConfig& config) : config_(config) {}

  FreeSpaceEvidence observe(LazyBeamField& beams, std::uint64_t stamp) const override {
    const auto seed = static_cast<std::uint64_t>(config_.free_space.seed);
    return sampleBeams(config_, beams.beams(), [&](std::size_t beam, double length, auto&& add) {
      for (int n = 0; n < config_.free_space.samples_per_beam; ++n) {
        add(Distance(counterRandom(seed, stamp, beam, static_cast<std::uint64_t>(n)), length));
      }
    });
  }

 private:
  MapperConfig config_;
};

}  // namespace

std::unique_ptr<FreeSpaceModel> makeUniformSamples(const MapperConfig& config) {
  return std::make_unique<RandomSamples<uniformDistance>>(config);
}

std::unique_ptr<FreeSpaceModel> makeLinearSamples(const MapperConfig& config) {
  return std::make_unique<RandomSamples<linearDistance>>(config);
}

}  // namespace bki_mapping
