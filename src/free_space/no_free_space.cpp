#include "free_space/free_space_model.h"

namespace bki_mapping {
namespace {

/// Mode `none`: only hits are mapped.
class NoFreeSpace : public FreeSpaceModel {
  bool needsBeams() const override { return false; }
  FreeSpaceEvidence observe(LazyBeamField&, std::uint64_t, ThreadPool&) override { return {}; }
};

}  // namespace

std::unique_ptr<FreeSpaceModel> makeNoFreeSpace(const FreeSpaceSetup&) {
  return std::make_unique<NoFreeSpace>();
}

}  // namespace bki_mapping
