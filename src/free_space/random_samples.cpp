#include "free_space/beam_samples.h"
#include "free_space/free_space_model.h"
#include "free_space/random_distance.h"
#include "parallel/counter_random.h"

namespace bki_mapping {
namespace {

/// Modes `uniform` and `linear`: a fixed number of random samples for each beam. `Distance` is that of the
/// mode from random_distance.h, where Theorem 1 is, too.
template <double (*Distance)(double, double)>
class RandomSamples : public FreeSpaceModel {
 public:
  explicit RandomSamples(const FreeSpaceSetup& setup) : config_(setup.config), samples_(setup) {}

  FreeSpaceEvidence observe(LazyBeamField& beams, std::uint64_t stamp, ThreadPool& pool) override {
    BeamSamples::limit(static_cast<double>(beams.beams().ends.size()) * config_.samples_per_beam,
                       config_.samples_per_beam);
    const CounterRandom random(static_cast<std::uint64_t>(config_.seed), stamp);
    return samples_.sample(beams.beams(), pool, [&](std::size_t beam, double length, auto&& add) {
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

std::unique_ptr<FreeSpaceModel> makeUniformSamples(const FreeSpaceSetup& setup) {
  return std::make_unique<RandomSamples<uniformDistance>>(setup);
}

std::unique_ptr<FreeSpaceModel> makeLinearSamples(const FreeSpaceSetup& setup) {
  return std::make_unique<RandomSamples<linearDistance>>(setup);
}

}  // namespace bki_mapping
