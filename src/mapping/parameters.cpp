#include "bki_mapping/mapping/parameters.h"

#include <cmath>
#include <set>

namespace bki_mapping {
namespace {

/// Evidence, gains and scales beyond this could add up to more than a float holds.
constexpr double kMostEvidence = 1e9;

const auto positive = [](double x) { return x > 0.0; };
const auto notNegative = [](double x) { return x >= 0.0; };
const auto positiveEvidence = [](double x) { return x > 0.0 && x <= kMostEvidence; };
const auto evidence = [](double x) { return x >= 0.0 && x <= kMostEvidence; };
const char* const kPositiveEvidence = "a number > 0, at most 1e9";
const char* const kEvidence = "a number from 0 to 1e9";

}  // namespace

std::vector<Parameter> mapperParameters() {
  return {
      realParameter<MapperConfig>(
          "resolution", "a number from 0.001 to 1000", "m", "Edge of a voxel.",
          [](MapperConfig & c) -> auto& { return c.resolution; },
          [](double x) { return x >= 0.001 && x <= 1000.0; }),
      realParameter<MapperConfig>(
          "prior", kPositiveEvidence, "", "Concentration alpha0 of each class, and of free, before any scan.",
          [](MapperConfig & c) -> auto& { return c.prior; }, positiveEvidence),
      realParameter<MapperConfig>(
          "downsample_resolution", "a number from 0.001 to 1000, or 0", "m",
          "Edge of the cells in which hits and free samples are merged into one; 0 turns it off.",
          [](MapperConfig & c) -> auto& { return c.downsample_resolution; },
          [](double x) { return x == 0.0 || (x >= 0.001 && x <= 1000.0); }),
      choiceParameter<MapperConfig>(
          "kernel/type", {"sparse", "counting"},
          "sparse: evidence falls off with the distance; counting: one to the voxel that holds the point.",
          [](MapperConfig & c) -> auto& { return c.kernel.type; }),
      realParameter<MapperConfig>(
          "kernel/length", "a number >= 0", "m",
          "Support radius l of the sparse kernel; 0: as long as the resolution.",
          [](MapperConfig & c) -> auto& { return c.kernel.length; }, notNegative),
      realParameter<MapperConfig>(
          "kernel/scale", kPositiveEvidence, "", "Value sigma0 of the sparse kernel at distance 0.",
          [](MapperConfig & c) -> auto& { return c.kernel.scale; }, positiveEvidence),
      textParameter<MapperConfig>(
          "free_space/mode", "one of none, even, uniform, linear, line",
          "How space between the sensor and the hits is told to be free.",
          [](MapperConfig & c) -> auto& { return c.free_space.mode; }),
      realParameter<MapperConfig>(
          "free_space/gap", "a number >= 0.01", "m", "Distance between samples of a beam, mode even.",
          [](MapperConfig & c) -> auto& { return c.free_space.gap; }, [](double x) { return x >= 0.01; }),
      integerParameter<MapperConfig>(
          "free_space/samples_per_beam", 1, 1000, "Samples a beam, modes uniform and linear.",
          [](MapperConfig & c) -> auto& { return c.free_space.samples_per_beam; }),
      integerParameter<MapperConfig>(
          "free_space/seed", 0, 9007199254740991.0,
          "Seed of the samples, modes uniform and linear; same seed, same map.",
          [](MapperConfig & c) -> auto& { return c.free_space.seed; }),
      choiceParameter<MapperConfig>(
          "free_space/weight", {"uniform", "linear", "bilinear"},
          "Weight along a beam, mode line: 1, rho or min(rho, 1 - rho), with rho = 0 at the sensor and 1 "
          "at the hit.",
          [](MapperConfig & c) -> auto& { return c.free_space.weight; }),
      choiceParameter<MapperConfig>(
          "free_space/extent", {"mapped", "observed"},
          "Mode line: only blocks that hold hits are cleared, or all space along the beams is mapped.",
          [](MapperConfig & c) -> auto& { return c.free_space.extent; }),
      choiceParameter<MapperConfig>(
          "free_space/beam_index", {"table", "rtree"},
          "How beams near a block are found; the map is the same, table is faster.",
          [](MapperConfig & c) -> auto& { return c.free_space.beam_index; }),
      choiceParameter<MapperConfig>(
          "free_space/hits_before_misses", {"false", "true"},
          "Whether a voxel that holds a hit of a scan, after down-sampling, takes no evidence for free from "
          "the "
          "same scan.",
          [](MapperConfig & c) -> auto& { return c.free_space.hits_before_misses; }),
      choiceParameter<MapperConfig>(
          "free_space/evidence_before_misses", {"false", "true"},
          "Whether a voxel that gets evidence from a hit of a scan takes no evidence for free from the same "
          "scan.",
          [](MapperConfig & c) -> auto& { return c.free_space.evidence_before_misses; }),
      realParameter<MapperConfig>(
          "free_gain/dynamic", kPositiveEvidence, "",
          "Gain on the evidence for free when the state of a voxel is decided whose likeliest class is "
          "flagged "
          "dynamic; above 1, what moved is cleared sooner.",
          [](MapperConfig & c) -> auto& { return c.free_gain.dynamic_classes; }, positiveEvidence),
      realParameter<MapperConfig>(
          "free_gain/static", kPositiveEvidence, "",
          "The same for classes not flagged dynamic; below 1, beams that graze a surface do not eat it.",
          [](MapperConfig & c) -> auto& { return c.free_gain.static_classes; }, positiveEvidence),
      realParameter<MapperConfig>(
          "free_gain/persistence", kEvidence, "",
          "Evidence of hits over which a gain above 1 falls to 1/e of what it is above 1: what is hit scan "
          "after "
          "scan stands, even if its class can move; 0: gains do not fall.",
          [](MapperConfig & c) -> auto& { return c.free_gain.persistence; }, evidence),
      realParameter<MapperConfig>(
          "scan_limit/hits", kEvidence, "",
          "The most evidence that the hits of one scan add to a voxel, shared by its classes in proportion; "
          "0: no limit.",
          [](MapperConfig & c) -> auto& { return c.scan_limit.hits; }, evidence),
      realParameter<MapperConfig>(
          "scan_limit/free", kEvidence, "",
          "The most evidence for free that one scan adds to a voxel; 0: no limit.",
          [](MapperConfig & c) -> auto& { return c.scan_limit.free; }, evidence),
      integerParameter<MapperConfig>(
          "scan_limit/blocks", 0, 1e9,
          "The most blocks of 8 x 8 x 8 voxels that the hits of one scan, or its free space, may touch; a "
          "scan "
          "beyond it is refused whole; 0: as many as lie within the sensor's reach, at most 262144.",
          [](MapperConfig & c) -> auto& { return c.scan_limit.blocks; }),
      realParameter<MapperConfig>(
          "sensor_model/min_range", "a number >= 0", "m", "Nearer hits are dropped.",
          [](MapperConfig & c) -> auto& { return c.sensor_model.min_range; }, notNegative),
      realParameter<MapperConfig>(
          "sensor_model/max_range", "a number > 0, or -1 for not known", "m",
          "Hits beyond this range do not occupy voxels; -1: not known, and points beyond 300 m are left out "
          "as "
          "faults.",
          [](MapperConfig & c) -> auto& { return c.sensor_model.max_range; },
          [](double x) { return x > 0.0 || x == -1.0; }),
      choiceParameter<MapperConfig>(
          "clear_beyond_max_range", {"false", "true"},
          "Whether beams with a hit beyond sensor_model/max_range clear the space up to it.",
          [](MapperConfig & c) -> auto& { return c.clear_beyond_max_range; }),
      choiceParameter<MapperConfig>(
          "occlusion", {"none", "mapped", "all"},
          "Mark voxels behind hits: not at all, in blocks of the map, or wherever beams point.",
          [](MapperConfig & c) -> auto& { return c.occlusion; }),
      choiceParameter<MapperConfig>(
          "unlabelled_points", {"occupied", "ignore"},
          "Whether hits of the class flagged unlabelled are mapped.",
          [](MapperConfig & c) -> auto& { return c.unlabelled_points; }),
      choiceParameter<MapperConfig>(
          "unknown_labels", {"ignore", "unlabelled"},
          "What becomes of hits whose label is not in the class table.",
          [](MapperConfig & c) -> auto& { return c.unknown_labels; }),
      choiceParameter<MapperConfig>(
          "label_values", {"raw", "id"},
          "Whether labels of clouds are the data set's raw numbers or ids of the class table.",
          [](MapperConfig & c) -> auto& { return c.label_values; }),
      realParameter<MapperConfig>(
          "memory_limit", "a number >= 0", "MB",
          "The most memory that the map may take; a scan that would exceed it is refused whole; 0: no limit.",
          [](MapperConfig & c) -> auto& { return c.memory_limit; }, notNegative),
      integerParameter<MapperConfig>(
          "threads", 0, 1024, "Threads of the update; 0 takes all cores. The map does not depend on it.",
          [](MapperConfig & c) -> auto& { return c.threads; }),
  };
}

bool changesWhileMapping(const std::string& name) {
  static const std::set<std::string> fixed = {"resolution",      "prior",
                                              "kernel/type",     "kernel/length",
                                              "kernel/scale",    "free_space/beam_index",
                                              "free_space/seed", "unknown_labels",
                                              "label_values",    "downsample_resolution",
                                              "threads"};
  return fixed.count(name) == 0;
}

void setParameters(MapperConfig& config, const std::map<std::string, std::string>& values) {
  setNamedParameters(mapperParameters(), config, values);
}

std::vector<std::string> settingWarnings(const MapperConfig& config) {
  std::vector<std::string> warnings;
  const double half_diagonal = 0.5 * std::sqrt(3.0) * config.resolution;
  if (config.kernel.type == KernelType::kSparse &&
      config.kernel.lengthFor(config.resolution) < half_diagonal) {
    warnings.push_back("kernel/length " + numberText(config.kernel.length) +
                       " m is below half a voxel's diagonal, " +
                       numberText(std::round(1e3 * half_diagonal) / 1e3) +
                       " m: hits that reach no voxel's centre are lost; leave kernel/length 0, or make "
                       "resolution finer");
  }
  return warnings;
}

}  // namespace bki_mapping
