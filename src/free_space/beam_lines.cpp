#include "bki_mapping/free_space/modes.h"
#include "bki_mapping/inference/beam_evidence.h"

namespace bki_mapping {
namespace {

/// Whole beams, retrieved on the sphere of directions.
class BeamLines : public FreeSpaceModel {
 public:
  explicit BeamLines(const FreeSpaceConfig& config) : config_(config) {}

  FreeSpaceEvidence observe(LazyBeamField& beams, std::uint64_t) const override {
    return {std::make_unique<BeamEvidence>(beams.field(), config_.weight, config_.extent),
            beams.beams().ends.size()};
  }

 private:
  FreeSpaceConfig config_;
};

}  // namespace

std::unique_ptr<FreeSpaceModel> makeBeamLines(const MapperConfig& config) {
  return std::make_unique<BeamLines>(config.free_space);
}

}  // namespace bki_mapping
