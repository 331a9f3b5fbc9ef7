#include "ros/mapping_diagnostics.h"

#include <algorithm>
#include <cmath>

#include "bki_mapping/core/named_parameter.h"
#include "core/counted.h"
#include "ros/load_advice.h"

namespace bki_mapping::ros_interface {
namespace {

using diagnostic_msgs::DiagnosticStatus;

/// The clouds dropped between two statuses by reason, such as "3 queue full, 1 empty".
std::string newDrops(const MappingStatus& before, const MappingStatus& now) {
  std::string text;
  for (const DropKind& kind : dropKinds()) {
    const std::uint64_t count = now.*kind.count - before.*kind.count;
    if (count > 0) text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + kind.name;
  }
  return text;
}

}  // namespace

Health judge(const MappingStatus& before, const MappingStatus& now, const MapperConfig& config,
             const Health& points) {
  const std::string drops = newDrops(before, now);
  if (now.paused) return {DiagnosticStatus::WARN, "paused; call ~resume to go on"};
  if (now.read_only) return {DiagnosticStatus::OK, "the map is read only"};
  if (now.received == 0) return {DiagnosticStatus::WARN, "no cloud has come yet; check the topic"};
  if (!drops.empty() && now.integrated == before.integrated) {
    return {DiagnosticStatus::ERROR, "nothing is being mapped; dropped: " + drops};
  }
  Health health = points;
  const auto warn = [&](const std::string& text) {
    health.level = std::max<std::uint8_t>(health.level, DiagnosticStatus::WARN);
    health.message += (health.message.empty() ? "" : "; ") + text;
  };
  if (!drops.empty()) warn("dropped: " + drops);
  if (!now.map_file_fault.empty()) warn(now.map_file_fault);
  if (now.corrections_refused > before.corrections_refused) {
    warn("corrected_path was refused: " + now.last_correction_refusal);
  }
  if (const std::string advice = loadAdvice(config, now.integration_median_ms, now.received_hz);
      !advice.empty()) {
    warn(advice);
  }
  constexpr double kMany = 0.03;  // in dry weather, at most a hundredth are isolated
  if (now.weather_particles > kMany) {
    warn(percentText(now.weather_particles) +
         " of the returns are rain, snow, fog or dust, and half of the "
         "others are within " +
         numberText(std::round(now.weather_half_range)) + " m; slow down");
  }
  constexpr double kMost = 0.75;  // half of the beams of a lidar that looks up and down meet the sky
  if (now.weather_no_returns > kMost) {
    warn(percentText(now.weather_no_returns) +
         " of the beams return nothing; clean the lidar, or slow down in fog and rain");
  }
  // A map may be empty at one report because it was reset.
  if (now.blocks == 0 && before.blocks == 0 && before.integrated > 0 &&
      now.points_used > before.points_used) {
    warn("the map is empty, though " + std::to_string(now.points_used - before.points_used) +
         " points were used since the last report; check resolution, kernel/length and window");
  }
  if (health.message.empty() && now.received == before.received && now.waiting == 0) warn("no clouds come");
  return health.message.empty() ? Health{DiagnosticStatus::OK, "mapping"} : health;
}

MappingDiagnostics::MappingDiagnostics(const ros::NodeHandle& node, const ros::NodeHandle& private_node,
                                       double period)
    : updater_(node, private_node, private_node.getNamespace()), period_(period) {
  updater_.setHardwareID("none");
  updater_.add("mapping", [this](diagnostic_updater::DiagnosticStatusWrapper& out) { fill(out); });
}

void MappingDiagnostics::report(const MappingStatus& status, const MapperConfig& config,
                                const Health& points) {
  now_ = status;
  health_ = judge(before_, now_, config, points);
  before_ = now_;
  updater_.force_update();
}

void MappingDiagnostics::fill(diagnostic_updater::DiagnosticStatusWrapper& out) const {
  out.summary(health_.level, health_.message);
  out.add("received", now_.received);
  out.add("integrated", now_.integrated);
  out.add("waiting", now_.waiting);
  for (const DropKind& kind : dropKinds()) out.add(std::string("dropped: ") + kind.name, now_.*kind.count);
  out.add("received [Hz]", now_.received_hz);
  out.add("integrated [Hz]", now_.integrated_hz);
  out.add("latency, median [ms]", now_.latency_median_ms);
  out.add("latency, 99th percentile [ms]", now_.latency_p99_ms);
  out.add("integration, median [ms]", now_.integration_median_ms);
  out.add("integration, 99th percentile [ms]", now_.integration_p99_ms);
  out.add("load", loadOf(now_.integration_median_ms, now_.received_hz));
  out.add("points received", now_.points_received);
  out.add("points used", now_.points_used);
  out.add("points: beams without a return", now_.points_no_returns);
  for (const PointKind& kind : pointKinds())
    out.add(std::string("points: ") + kind.name, now_.*kind.in_status);
  out.add("labels not in the class table", now_.labels_not_in_table);
  out.add("last refused change of settings", now_.last_refusal);
  out.add("time jumps", now_.time_jumps);
  out.add("tf jumps", now_.tf_jumps);
  out.add("scans kept", now_.journal_scans);
  out.add("scans to be moved", now_.correction_to_go);
  out.add("scans that could not be moved", now_.correction_failed);
  out.add("last refused corrected_path", now_.last_correction_refusal);
  out.add("weather: particles", now_.weather_particles);
  out.add("weather: beams without a return", now_.weather_no_returns);
  out.add("weather: half of the returns within [m]", now_.weather_half_range);
  out.add("blocks", now_.blocks);
  out.add("map [bytes]", now_.map_bytes);
  out.add("map file", now_.map_file_fault);
}

}  // namespace bki_mapping::ros_interface
