#include "bki_mapping/core/parameters.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <sstream>
#include <stdexcept>

namespace bki_mapping {
namespace {

[[noreturn]] void refuse(const std::string& name, const std::string& value, const std::string& values) {
  throw std::invalid_argument("parameter " + name + " is '" + value + "', but must be " + values);
}

std::string text(double value) {
  std::ostringstream out;
  out.precision(std::numeric_limits<double>::digits10);
  out << value;
  return out.str();
}

double parseNumber(const std::string& value) {
  char* end = nullptr;
  const double number = std::strtod(value.c_str(), &end);
  const bool whole = !value.empty() && *end == '\0';
  return whole ? number : std::numeric_limits<double>::quiet_NaN();
}

/// A real number for which `allowed` holds. `field` maps MapperConfig& to double&.
template <typename Field, typename Allowed>
Parameter real(const std::string& name, const std::string& values, const std::string& unit,
               const std::string& description, Field field, Allowed allowed) {
  return {name,
          values,
          unit,
          description,
          [=](MapperConfig& config, const std::string& value) {
            const double number = parseNumber(value);
            if (!std::isfinite(number) || !allowed(number)) refuse(name, value, values);
            field(config) = number;
          },
          [=](const MapperConfig& config) { return text(field(const_cast<MapperConfig&>(config))); }};
}

template <typename Field>
Parameter integer(const std::string& name, double least, double most, const std::string& description,
                  Field field) {
  const std::string values = "an integer from " + text(least) + " to " + text(most);
  return {
      name,
      values,
      "",
      description,
      [=](MapperConfig& config, const std::string& value) {
        const double number = parseNumber(value);
        if (!(number >= least && number <= most) || number != std::floor(number)) {
          refuse(name, value, values);
        }
        field(config) = static_cast<std::remove_reference_t<decltype(field(config))>>(number);
      },
      [=](const MapperConfig& config) { return std::to_string(field(const_cast<MapperConfig&>(config))); }};
}

/// One of several words; `names` stand in the order of the enumeration (or of false, true).
template <typename Field>
Parameter choice(const std::string& name, const std::vector<std::string>& names,
                 const std::string& description, Field field) {
  std::string values = "one of";
  for (const auto& word : names) values += (&word == &names.front() ? " " : ", ") + word;
  return {name,
          values,
          "",
          description,
          [=](MapperConfig& config, const std::string& value) {
            const auto found = std::find(names.begin(), names.end(), value);
            if (found == names.end()) refuse(name, value, values);
            using Value = std::remove_reference_t<decltype(field(config))>;
            field(config) = static_cast<Value>(found - names.begin());
          },
          [=](const MapperConfig& config) {
            return names[static_cast<std::size_t>(field(const_cast<MapperConfig&>(config)))];
          }};
}

std::size_t editDistance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row.back();
}

const auto positive = [](double x) { return x > 0.0; };
const auto notNegative = [](double x) { return x >= 0.0; };

}  // namespace

std::vector<Parameter> mapperParameters() {
  Parameter mode{"free_space/mode",
                 "one of none, even, uniform, linear, line",
                 "",
                 "How space between the sensor and the hits is told to be free.",
                 [](MapperConfig& c, const std::string& v) { c.free_space.mode = v; },
                 [](const MapperConfig& c) { return c.free_space.mode; }};
  return {
      real(
          "resolution", "a number > 0", "m", "Edge of a voxel.",
          [](MapperConfig & c) -> auto& { return c.resolution; }, positive),
      real(
          "prior", "a number > 0", "", "Concentration alpha0 of each class, and of free, before any scan.",
          [](MapperConfig & c) -> auto& { return c.prior; }, positive),
      real(
          "downsample_resolution", "a number >= 0", "m",
          "Edge of the cells in which hits and free samples are merged into one; 0 turns it off.",
          [](MapperConfig & c) -> auto& { return c.downsample_resolution; }, notNegative),
      choice(
          "kernel/type", {"sparse", "counting"},
          "sparse: evidence falls off with the distance; counting: one to the voxel that holds the point.",
          [](MapperConfig & c) -> auto& { return c.kernel.type; }),
      real(
          "kernel/length", "a number > 0", "m", "Support radius l of the sparse kernel.",
          [](MapperConfig & c) -> auto& { return c.kernel.length; }, positive),
      real(
          "kernel/scale", "a number > 0", "", "Value sigma0 of the sparse kernel at distance 0.",
          [](MapperConfig & c) -> auto& { return c.kernel.scale; }, positive),
      mode,
      real(
          "free_space/gap", "a number >= 0.01", "m", "Distance between samples of a beam, mode even.",
          [](MapperConfig & c) -> auto& { return c.free_space.gap; }, [](double x) { return x >= 0.01; }),
      integer(
          "free_space/samples_per_beam", 1, 1000, "Samples a beam, modes uniform and linear.",
          [](MapperConfig & c) -> auto& { return c.free_space.samples_per_beam; }),
      integer(
          "free_space/seed", 0, 9007199254740991.0,
          "Seed of the samples, modes uniform and linear; same seed, same map.",
          [](MapperConfig & c) -> auto& { return c.free_space.seed; }),
      choice(
          "free_space/weight", {"uniform", "linear", "bilinear"},
          "Weight along a beam, mode line: 1, rho or min(rho, 1 - rho), with rho = 0 at the sensor and 1 "
          "at the hit.",
          [](MapperConfig & c) -> auto& { return c.free_space.weight; }),
      choice(
          "free_space/extent", {"mapped", "observed"},
          "Mode line: only blocks that hold hits are cleared, or all space along the beams is mapped.",
          [](MapperConfig & c) -> auto& { return c.free_space.extent; }),
      choice(
          "free_space/beam_index", {"table", "rtree"},
          "How beams near a block are found; the map is the same, table is faster.",
          [](MapperConfig & c) -> auto& { return c.free_space.beam_index; }),
      real(
          "sensor_model/min_range", "a number >= 0", "m", "Nearer hits are dropped.",
          [](MapperConfig & c) -> auto& { return c.sensor_model.min_range; }, notNegative),
      real(
          "sensor_model/max_range", "a number > 0, or -1 for no limit", "m", "Farther hits are no hits.",
          [](MapperConfig & c) -> auto& { return c.sensor_model.max_range; },
          [](double x) { return x > 0.0 || x == -1.0; }),
      choice(
          "sensor_model/clear_beyond_max_range", {"false", "true"},
          "Whether beams with a hit beyond max_range clear the space up to max_range.",
          [](MapperConfig & c) -> auto& { return c.sensor_model.clear_beyond_max_range; }),
      choice(
          "occlusion", {"none", "mapped", "all"},
          "Mark voxels behind hits: not at all, in blocks of the map, or wherever beams point.",
          [](MapperConfig & c) -> auto& { return c.occlusion; }),
      choice(
          "unlabelled_points", {"occupied", "ignore"},
          "Whether hits of the class flagged unlabelled are mapped.",
          [](MapperConfig & c) -> auto& { return c.unlabelled_points; }),
      choice(
          "unknown_labels", {"ignore", "unlabelled"},
          "What becomes of hits whose label is not in the class table.",
          [](MapperConfig & c) -> auto& { return c.unknown_labels; }),
      choice(
          "label_values", {"raw", "id"},
          "Whether labels of clouds are the data set's raw numbers or ids of the class table.",
          [](MapperConfig & c) -> auto& { return c.label_values; }),
      integer(
          "threads", 0, 1024, "Threads of the update; 0 takes all cores. The map does not depend on it.",
          [](MapperConfig & c) -> auto& { return c.threads; }),
  };
}

void setParameters(MapperConfig& config, const std::map<std::string, std::string>& values) {
  const std::vector<Parameter> parameters = mapperParameters();
  std::vector<std::string> names;
  for (const Parameter& p : parameters) names.push_back(p.name);

  MapperConfig changed = config;
  std::string faults;
  for (const auto& [name, value] : values) {
    try {
      const auto found = std::find(names.begin(), names.end(), name);
      if (found == names.end()) {
        throw std::invalid_argument("parameter '" + name + "' is unknown" + nearestWord(name, names));
      }
      parameters[static_cast<std::size_t>(found - names.begin())].set(changed, value);
    } catch (const std::invalid_argument& fault) {
      faults += (faults.empty() ? "" : "; ") + std::string(fault.what());
    }
  }
  if (!faults.empty()) throw std::invalid_argument(faults);
  config = changed;
}

std::string nearestWord(const std::string& word, const std::vector<std::string>& known) {
  std::size_t least = word.size() / 2 + 2;
  std::string nearest;
  for (const std::string& candidate : known) {
    const std::size_t distance = editDistance(word, candidate);
    if (distance < least) {
      least = distance;
      nearest = candidate;
    }
  }
  return nearest.empty() ? "" : "; did you mean '" + nearest + "'?";
}

}  // namespace bki_mapping
