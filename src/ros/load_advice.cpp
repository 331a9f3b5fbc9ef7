#include "bki_mapping/ros/load_advice.h"

#include <cmath>
#include <vector>

#include "bki_mapping/core/named_parameter.h"

namespace bki_mapping::ros_shell {
namespace {

/// Time of a mode in that of mode none: SemanticKITTI 04, two threads, from docs/performance.md.
double costOf(const FreeSpaceConfig& free_space) {
  if (free_space.mode == "none") return 1.0;
  if (free_space.mode == "even") return 7.9 / free_space.gap;
  if (free_space.mode == "line") return free_space.extent == FreeSpaceExtent::kObserved ? 8.5 : 5.6;
  return 1.65 + 0.39 * free_space.samples_per_beam;
}

/// Time of a scan with resolution, kernel and down-sampling twice as coarse, and with half the range, in that
/// of now: measured on SemanticKITTI 04 and 00, 0.39 to 0.45 for lines, 0.55 to 0.72 for the others; 0.64 to
/// 1.
double costOfCoarser(const std::string& mode) {
  return mode == "line" ? 0.42 : 0.62;
}
constexpr double kCostOfHalfTheRange = 0.8;

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
  text += "; resolution " + rounded(2.0 * config.resolution) + ", kernel/length " +
          rounded(2.0 * config.kernel.lengthFor(config.resolution)) + " and downsample_resolution " +
          rounded(2.0 * config.downsample_resolution) + " would take about " +
          milliseconds(integration_ms * costOfCoarser(config.free_space.mode));
  FreeSpaceConfig mapped = config.free_space, linear = config.free_space;
  mapped.extent = FreeSpaceExtent::kMapped;
  linear.mode = "linear";
  linear.samples_per_beam = 1;
  const double now = costOf(config.free_space);
  if (config.free_space.mode == "line" && costOf(mapped) < now) {
    text += "; free_space/extent mapped about " + milliseconds(integration_ms * costOf(mapped) / now);
  }
  if (costOf(linear) < now) {
    text += "; free_space/mode linear with one sample a beam about " +
            milliseconds(integration_ms * costOf(linear) / now);
  }
  const double range = config.sensor_model.max_range;
  if (range > 0.0) {
    text += "; sensor_model/max_range " + numberText(range / 2.0) + " about " +
            milliseconds(integration_ms * kCostOfHalfTheRange);
  } else {
    text += "; sensor_model/max_range leaves out what is far";
  }
  return text;
}

}  // namespace bki_mapping::ros_shell
