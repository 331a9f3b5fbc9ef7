#include "bki_mapping/free_space/modes.h"
#include "bki_mapping/inference/beam_evidence.h"

namespace bki_mapping {
namespace {

/// Whole beams, retrieved on the sphere of directions.
class BeamLines : public FreeSpaceModel {
 public:
  explicit BeamLines(const FreeSpaceConfig& config) : evidence_(config.weight, config.extent) {}

  FreeSpaceEvidence observe(LazyBeamField& beams, std::uint64_t, Workers& workers) override {
    evidence_.setField(beams.field(workers), workers);
    return {&evidence_, beams.beams().ends.size()};
  }

 private:
  BeamEvidence evidence_;
};

}  // namespace

std::unique_ptr<FreeSpaceModel> makeBeamLines(const MapperConfig& config) {
  return std::make_unique<BeamLines>(config.free_space);
}

}  // namespace bki_mapping
