#include "bki_mapping/free_space/beam_samples.h"
#include "bki_mapping/free_space/modes.h"
#include "bki_mapping/inference/counter_random.h"

namespace bki_mapping {
namespace {

/// A fixed number of random samples a beam; `Distance` maps (u, length) to the distance from the sensor.
template <double (*Distance)(double, double)>
class RandomSamples : public FreeSpaceModel {
 public:
  explicit RandomSamples(const MapperConfig& config) : config_(config.free_space), samples_(config) {}

  FreeSpaceEvidence observe(LazyBeamField& beams, std::uint64_t stamp, Workers& workers) override {
    BeamSamples::limit(static_cast<double>(beams.beams().ends.size()) * config_.samples_per_beam,
                       config_.samples_per_beam);
    const CounterRandom random(static_cast<std::uint64_t>(config_.seed), stamp);
    return samples_.sample(beams.beams(), workers, [&](std::size_t beam, double length, auto&& add) {
      const std::uint64_t key = random.beamKey(beam);
      for (int n = 0; n < config_.samples_per_beam; ++n) {
        add(Distance(CounterRandom::draw(key, static_cast<std::uint64_t>(n)), length));
      }
    });
  }

 private:
  FreeSpaceConfig config_;
  BeamSamples samples_;
};

}  // namespace

std::unique_ptr<FreeSpaceModel> makeUniformSamples(const MapperConfig& config) {
  return std::make_unique<RandomSamples<uniformDistance>>(config);
}

std::unique_ptr<FreeSpaceModel> makeLinearSamples(const MapperConfig& config) {
  return std::make_unique<RandomSamples<linearDistance>>(config);
}

}  // namespace bki_mapping
