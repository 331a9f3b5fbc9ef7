#include "beams/line_evidence.h"
#include "free_space/free_space_model.h"

namespace bki_mapping {
namespace {

/// Mode `line`: whole beams, looked up by direction.
class BeamLines : public FreeSpaceModel {
 public:
  explicit BeamLines(const FreeSpaceConfig& config)
      : evidence_(config.weight, config.extent), depends_on_map_(config.extent == FreeSpaceExtent::kMapped) {}

  FreeSpaceEvidence observe(LazyBeamField& beams, std::uint64_t, ThreadPool& pool) override {
    evidence_.setField(beams.field(pool), pool);
    return {&evidence_, beams.beams().ends.size()};
  }
  bool dependsOnMap() const override { return depends_on_map_; }

 private:
  LineEvidence evidence_;
  bool depends_on_map_;
};

}  // namespace

std::unique_ptr<FreeSpaceModel> makeBeamLines(const FreeSpaceSetup& setup) {
  return std::make_unique<BeamLines>(setup.config);
}

}  // namespace bki_mapping
