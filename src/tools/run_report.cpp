#include "tools/run_report.h"

#include <sys/resource.h>

#include <cmath>
#include <iomanip>
#include <map>
#include <sstream>

#include "bki_mapping/mapping/mapper_config.h"
#include "bki_mapping/rules/voxel_state.h"
#include "core/counted.h"
#include "core/quantile.h"
#include "export/ordered_json.h"

namespace bki_mapping::tools {
namespace {

using Json = OrderedJson;

struct VoxelCounts {
  std::size_t free = 0, occupied = 0, occluded = 0;
  std::map<ClassId, std::size_t> by_class;
};

VoxelCounts countVoxels(const SemanticMapper& mapper) {
  VoxelCounts counts;
  forEachKnownVoxel(mapper.map(), mapper.rules(), [&](const VoxelIndex&, const VoxelView& view) {
    counts.free += view.state == VoxelState::kFree;
    counts.occluded += view.state == VoxelState::kOccluded;
    if (view.state == VoxelState::kOccupied) {
      ++counts.occupied;
      ++counts.by_class[view.label];
    }
  });
  return counts;
}

std::vector<double> totals(const std::vector<ScanReport>& scans) {
  std::vector<double> values;
  for (const ScanReport& scan : scans) values.push_back(scan.stats.totalMs());
  return values;
}

Json scanJson(const ScanReport& scan) {
  const ScanStats& s = scan.stats;
  const PointCounts& c = s.counts;
  return {{"name", scan.name},
          {"points", c.points},
          {"used", c.used},
          {"dropped",
           {{"not_finite", c.not_finite},
            {"at_sensor", c.at_sensor},
            {"too_near", c.too_near},
            {"beyond_max_range", c.beyond_max},
            {"outside_map", c.outside_map},
            {"unknown_label", c.unknown_label},
            {"unlabelled", c.unlabelled},
            {"airborne", c.airborne},
            {"isolated", c.isolated},
            {"no_direction", c.no_direction}}},
          {"labels_not_in_table", c.labels_not_in_table},
          {"hits", s.hits},
          {"free_samples_or_beams", s.free_count},
          {"blocks", s.blocks},
          {"evidence_not_finite", s.not_finite},
          {"evidence_saturated", s.saturated},
          {"total_ms", s.totalMs()},
          {"observe_ms", s.observe_ms},
          {"evidence_ms", s.evidence_ms},
          {"collect_ms", s.collect_ms},
          {"update_ms", s.update_ms}};
}

/// Why points were left out of the map, and how many; "" if all are in it.
std::string leftOutText(const std::vector<ScanReport>& scans, const MapperConfig& config) {
  PointCounts sum;
  std::size_t refused = 0, saturated = 0;
  for (const ScanReport& scan : scans) {
    sum += scan.stats.counts;
    refused += scan.stats.not_finite;
    saturated += scan.stats.saturated;
  }
  const std::string reach = numberText(config.sensor_model.reach()) + " m";
  const std::pair<std::size_t, std::string> reasons[] = {
      {sum.not_finite, "not finite"},
      {sum.at_sensor, "at the sensor"},
      {sum.too_near, "nearer than sensor_model/min_range"},
      {sum.beyond_max, config.sensor_model.knowsRange()
                           ? "beyond sensor_model/max_range"
                           : "beyond " + reach + " (set sensor_model/max_range if the sensor sees farther)"},
      {sum.outside_map, "outside of the map"},
      {sum.unknown_label, "with labels that the class table does not list (see --classes and label_values)"},
      {sum.unlabelled, "unlabelled"},
      {sum.airborne, "of airborne classes"},
      {sum.no_direction, "without a direction"}};
  std::string text;
  for (const auto& [count, reason] : reasons) {
    if (count > 0) text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + reason;
  }
  if (!text.empty()) text = "left out of " + std::to_string(sum.points) + " points: " + text;
  if (refused > 0) {
    text += (text.empty() ? "" : "\n") + std::to_string(refused) +
            " sums of voxels were not finite, and were left out; lower kernel/scale";
  }
  if (saturated > 0) {
    text += (text.empty() ? "" : "\n") + std::to_string(saturated) +
            " sums of voxels went beyond the greatest evidence, 32768, and were cut there; lower "
            "kernel/scale, or set rules/enabled";
  }
  return text;
}

}  // namespace

std::size_t peakResidentBytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::size_t>(usage.ru_maxrss) * 1024;
}

std::string reportJson(const SemanticMapper& mapper, const std::vector<ScanReport>& scans) {
  Json report;
  for (const Parameter& p : mapperParameters()) report["parameters"][p.name] = p.get(mapper.config());
  report["classes"] = mapper.classes().name();
  report["scans"] = Json::array();
  for (const ScanReport& scan : scans) report["scans"].push_back(scanJson(scan));
  const VoxelCounts counts = countVoxels(mapper);
  report["voxels"] = {{"occupied", counts.occupied}, {"free", counts.free}, {"occluded", counts.occluded}};
  for (const SemanticClass& c : mapper.classes().classes()) {
    const auto found = counts.by_class.find(c.id);
    report["voxels_by_class"][c.name] = found == counts.by_class.end() ? 0 : found->second;
  }
  report["blocks"] = mapper.map().size();
  report["map_bytes"] = mapper.map().bytes();
  report["peak_resident_bytes"] = peakResidentBytes();
  report["median_ms"] = quantile(totals(scans), 0.5);
  report["p99_ms"] = quantile(totals(scans), 0.99);
  return report.dump(2) + "\n";
}

std::string summaryText(const SemanticMapper& mapper, const std::vector<ScanReport>& scans) {
  const VoxelCounts counts = countVoxels(mapper);
  std::ostringstream out;
  out << std::fixed << std::setprecision(1);
  const std::string left_out = leftOutText(scans, mapper.config());
  if (!left_out.empty()) out << left_out << "\n";
  out << scans.size() << " scans, median " << quantile(totals(scans), 0.5) << " ms, 99th percentile "
      << quantile(totals(scans), 0.99) << " ms\n"
      << "voxels: " << counts.occupied << " occupied, " << counts.free << " free, " << counts.occluded
      << " occluded; map " << static_cast<double>(mapper.map().bytes()) / 1e6 << " MB, peak memory "
      << static_cast<double>(peakResidentBytes()) / 1e6 << " MB\n";
  for (const auto& [id, count] : counts.by_class) {
    const SemanticClass* known = mapper.classes().find(id);
    out << "  " << std::setw(20) << std::left << (known ? known->name : "?") << count << "\n";
  }
  return out.str();
}

std::string summaryText(const KeptScans& kept) {
  const MapCorrector::Progress progress = kept.corrector().progress();
  return counted(progress.scans, "scan") + " kept in " +
         std::to_string(std::llround(1e-3 * static_cast<double>(progress.bytes))) + " kB\n";
}

}  // namespace bki_mapping::tools
