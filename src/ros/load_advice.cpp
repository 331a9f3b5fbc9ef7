#include "ros/load_advice.h"

#include <cmath>
#include <optional>

#include "bki_mapping/core/named_parameter.h"

namespace bki_mapping::ros_interface {
namespace {

/// Median times of a scan [ms] on SemanticKITTI 04 with two threads. A test compares them with
/// docs/performance.md.
struct Medians {
  double none = 2.4;
  double linear = 5.8;     ///< one sample per beam
  double linear_5 = 10.5;  ///< five samples per beam
  double uniform = 4.9;    ///< one sample per beam
  double even = 22.2;      ///< gap 1 m
  double line_mapped = 10.1;
  double line_observed = 16.4;
};

/// The measured time of a mode [ms]; nothing if it has not been measured.
std::optional<double> timeOf(const FreeSpaceConfig& free_space) {
  const Medians measured;
  if (free_space.mode == "none") return measured.none;
  if (free_space.mode == "even") return measured.none + (measured.even - measured.none) / free_space.gap;
  if (free_space.mode == "line") {
    return free_space.extent == FreeSpaceExtent::kObserved ? measured.line_observed : measured.line_mapped;
  }
  const double more = (measured.linear_5 - measured.linear) / 4.0 * (free_space.samples_per_beam - 1);
  if (free_space.mode == "uniform") return measured.uniform + more;
  if (free_space.mode == "linear") return measured.linear + more;
  return std::nullopt;
}

/// Times after a change, as fractions of the present time.
struct Savings {
  double coarser;  ///< resolution, kernel and down-sampling twice as coarse
  double nearer;   ///< half the maximum range
};

/// The centres of the ranges in docs/tuning.md; a test compares them. Modes that have not been measured count
/// as samples.
Savings savingsOf(const FreeSpaceConfig& free_space) {
  if (free_space.mode == "none") return {0.68, 0.76};
  if (free_space.mode != "line") return {0.63, 0.85};
  return free_space.extent == FreeSpaceExtent::kObserved ? Savings{0.40, 0.71} : Savings{0.45, 0.72};
}

std::string rounded(double length) {
  return numberText(std::round(1e3 * length) / 1e3);
}

std::string milliseconds(double time) {
  return numberText(std::round(time)) + " ms";
}

}  // namespace

double loadOf(double integration_ms, double received_hz) {
  return 1e-3 * integration_ms * received_hz;
}

std::string loadAdvice(const MapperConfig& config, double integration_ms, double received_hz) {
  const double load = loadOf(integration_ms, received_hz);
  if (load <= 1.0) return "";
  std::string text = "an integration takes " + milliseconds(integration_ms) + ", but clouds come every " +
                     milliseconds(1e3 / received_hz) + ": mapping is " +
                     numberText(std::round(10.0 * load) / 10.0) + " times too slow";
  const Savings savings = savingsOf(config.free_space);
  text += "; resolution " + rounded(2.0 * config.resolution) + ", kernel/length " +
          rounded(2.0 * config.kernel.lengthFor(config.resolution)) + " and downsample_resolution " +
          rounded(2.0 * config.downsample_resolution) + " would take about " +
          milliseconds(integration_ms * savings.coarser);
  FreeSpaceConfig mapped = config.free_space, linear = config.free_space;
  mapped.extent = FreeSpaceExtent::kMapped;
  linear.mode = "linear";
  linear.samples_per_beam = 1;
  const auto now = timeOf(config.free_space);
  const auto advise = [&](const std::string& setting, const FreeSpaceConfig& other) {
    if (!now || !(*timeOf(other) < *now)) return;
    text += "; " + setting + " about " + milliseconds(integration_ms * *timeOf(other) / *now);
  };
  if (config.free_space.mode == "line") advise("free_space/extent mapped", mapped);
  advise("free_space/mode linear with one sample a beam", linear);
  const double range = config.sensor_model.max_range;
  if (range > 0.0) {
    text += "; sensor_model/max_range " + numberText(range / 2.0) + " about " +
            milliseconds(integration_ms * savings.nearer);
  } else {
    text += "; sensor_model/max_range leaves out distant points";
  }
  return text;
}

}  // namespace bki_mapping::ros_interface
