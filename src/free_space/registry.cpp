#include "free_space/free_space_model.h"

#include <map>
#include <stdexcept>

#include "bki_mapping/core/named_parameter.h"

namespace bki_mapping {

// Each is in the file of its kind of evidence.
std::unique_ptr<FreeSpaceModel> makeNoFreeSpace(const FreeSpaceSetup& setup);
std::unique_ptr<FreeSpaceModel> makeEvenSamples(const FreeSpaceSetup& setup);
std::unique_ptr<FreeSpaceModel> makeUniformSamples(const FreeSpaceSetup& setup);
std::unique_ptr<FreeSpaceModel> makeLinearSamples(const FreeSpaceSetup& setup);
std::unique_ptr<FreeSpaceModel> makeBeamLines(const FreeSpaceSetup& setup);

namespace {

using Maker = std::unique_ptr<FreeSpaceModel> (*)(const FreeSpaceSetup&);

const std::map<std::string, Maker>& registry() {
  static const std::map<std::string, Maker> makers = {
      {"none", makeNoFreeSpace},        // only hits
      {"even", makeEvenSamples},        // a sample every gap
      {"uniform", makeUniformSamples},  // random samples, uniform along the beam
      {"linear", makeLinearSamples},    // random samples, uniform over the plane
      {"line", makeBeamLines},          // whole beams
  };
  return makers;
}

}  // namespace

std::vector<std::string> freeSpaceModes() {
  std::vector<std::string> names;
  for (const auto& entry : registry()) names.push_back(entry.first);
  return names;
}

std::unique_ptr<FreeSpaceModel> makeFreeSpaceModel(const FreeSpaceSetup& setup) {
  const auto found = registry().find(setup.config.mode);
  if (found != registry().end()) return found->second(setup);
  std::string known;
  for (const std::string& name : freeSpaceModes()) known += (known.empty() ? "" : ", ") + name;
  throw std::invalid_argument("free_space/mode '" + shortText(setup.config.mode) +
                              "' is unknown; known modes: " + known +
                              nearestWord(setup.config.mode, freeSpaceModes()));
}

}  // namespace bki_mapping
