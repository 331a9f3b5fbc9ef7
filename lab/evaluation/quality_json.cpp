// The figures of evaluate_map as JSON.
#include <cmath>
#include <nlohmann/json.hpp>

#include "evaluation/quality_report.h"
#include "evaluation/space_figures.h"

namespace bki_mapping {
namespace {

using Json = nlohmann::json;

Json spaceJson(const SpaceQuality& space) {
  Json figures;
  for (const SpaceFigure& figure : kSpaceFigures) {
    figures[figure.name] = (space.*figure.proportion).fraction();
    figures[std::string(figure.name) + "_voxels"] = (space.*figure.proportion).total;
  }
  return figures;
}

Json reliabilityJson(const Reliability& reliability) {
  Json bins;
  for (const Reliability::Bin& bin : reliability.bins()) {
    const auto count = static_cast<double>(bin.count);
    bins.push_back({{"count", bin.count},
                    {"probability", bin.probability / count},
                    {"right", static_cast<double>(bin.right) / count}});
  }
  return bins;
}

/// What needs no classes.
Json trueSpaceJson(const TruthQuality& truth) {
  Json figures = spaceJson(truth.all);
  figures["occupancy_calibration_error"] = truth.occupancy.error();
  figures["occupancy_reliability"] = reliabilityJson(truth.occupancy);
  for (std::size_t bin = 0; bin < truth.by_distance.size(); ++bin) {
    Json at = spaceJson(truth.by_distance[bin]);
    if (bin < TruthQuality::kDistances.size()) at["up_to"] = TruthQuality::kDistances[bin];
    figures["by_distance"].push_back(std::move(at));
  }
  return figures;
}

Json truthJson(const TruthQuality& truth, const ClassTable& classes) {
  Json figures = trueSpaceJson(truth);
  figures["voxel_miou"] = truth.meanIou(classes);
  figures["voxel_occupied_iou"] = truth.occupiedIou(classes);
  figures["movable_voxels"] = truth.movable;
  figures["ghost_voxels"] = truth.ghosts;
  figures["mean_ghost_voxels"] = truth.mean_ghosts;
  for (const SemanticClass& c : classes.classes()) {
    if (truth.voxels.points(c.id) > 0) figures["voxel_iou"][c.name] = truth.voxels.iou(c.id);
  }
  return figures;
}

Json dynamicsJson(const DynamicsQuality& d) {
  Json by_label = Json::array();
  for (const auto& [label, kept] : d.by_label)
    by_label.push_back({{"label", label}, {"static_points", kept.points}, {"sa", kept.accuracy()}});
  return {{"static_points", d.static_points},  {"static_kept", d.static_kept},
          {"moving_points", d.moving_points},  {"moving_removed", d.moving_removed},
          {"floor_voxels", d.floor_voxels},    {"floor_holes", d.holes()},
          {"floor_open_holes", d.openHoles()}, {"sa", d.staticAccuracy()},
          {"sa_ground", d.groundAccuracy()},   {"sa_standing", d.standingAccuracy()},
          {"sa_other", d.otherAccuracy()},     {"sa_by_label", by_label},
          {"da", d.dynamicAccuracy()},         {"da_decidable", d.decidableAccuracy()},
          {"da_entered", d.enteredAccuracy()}, {"moving_shared", d.moving_shared},
          {"moving_unseen", d.moving_unseen},  {"aa", d.accuracy()},
          {"ha", d.harmonicAccuracy()}};
}

/// Null of nothing; a text for never.
Json delayJson(double seconds) {
  if (std::isinf(seconds)) return "never";
  return seconds;
}

Json presenceJson(const PresenceQuality& p) {
  Json json;
  for (std::size_t bin = 0; bin < PresenceQuality::kDistances.size(); ++bin) {
    json["by_distance"].push_back({{"up_to", PresenceQuality::kDistances[bin]},
                                   {"moving_points", p.moving[bin].points},
                                   {"pa_moving", p.moving[bin].accuracy()},
                                   {"moving_named", p.moving[bin].namedShare()},
                                   {"standing_points", p.standing[bin].points},
                                   {"pa_standing", p.standing[bin].accuracy()},
                                   {"standing_named", p.standing[bin].namedShare()}});
  }
  for (const auto& [name, delays] : {std::pair("appear", &p.appear), std::pair("clear", &p.clear)}) {
    json[name] = {{"voxels", delays->count()},
                  {"never", delays->never},
                  {"median", delayJson(delays->quantile(0.5))},
                  {"p95", delayJson(delays->quantile(0.95))}};
  }
  json["stayed_voxels"] = p.stayed;
  json["stayed_present"] = p.stayedShare();
  return json;
}

Json tracesJson(const TraceQuality& traces) {
  Json json = {{"points", traces.points}, {"by_distance", Json::array()}};
  for (std::size_t bin = 0; bin < TraceQuality::kDistances.size(); ++bin) {
    const TraceQuality::UpTo& near = traces.up_to[bin];
    json["by_distance"].push_back({{"up_to", TraceQuality::kDistances[bin]},
                                   {"points", near.after[0].points},
                                   {"left_after_1s", near.after[0].fraction()},
                                   {"left_after_10s", near.after[1].fraction()},
                                   {"left_at_end", near.at_end.fraction()}});
  }
  return json;
}

/// Adds them to the figures, if there are any.
void addTraces(const std::optional<TracesOfKinds>& traces, Json& figures) {
  if (!traces) return;
  if (traces->particles.points > 0) figures["particles"] = tracesJson(traces->particles);
  if (traces->images.points > 0) figures["images"] = tracesJson(traces->images);
}

Json octomapJson(const OctomapQuality& octomap) {
  Json figures = dynamicsJson(octomap.dynamics);
  figures["settings"] = octomap.settings;
  figures["presence"] = presenceJson(octomap.presence);
  addTraces(octomap.traces, figures);
  figures["occupancy_calibration_error"] = octomap.occupancy.error();
  figures["occupancy_reliability"] = reliabilityJson(octomap.occupancy);
  if (octomap.truth) figures["truth"] = trueSpaceJson(*octomap.truth);
  figures["median_ms"] = octomap.median.wall;
  figures["processor_ms"] = octomap.median.processor;
  figures["map_bytes"] = octomap.bytes;
  return figures;
}

Json otherJson(const OtherMap& other) {
  Json figures = dynamicsJson(other.dynamics);
  figures["settings"] = other.settings;
  figures["presence"] = presenceJson(other.presence);
  if (other.truth) figures["truth"] = trueSpaceJson(*other.truth);
  figures["map_bytes"] = other.bytes;
  return figures;
}

Json cloudJson(const CloudQuality& cloud) {
  return {{"sa", cloud.staticAccuracy()},
          {"da", cloud.dynamicAccuracy()},
          {"aa", cloud.accuracy()},
          {"ha", cloud.harmonicAccuracy()},
          {"static_points", cloud.static_points},
          {"static_kept", cloud.static_kept},
          {"moving_points", cloud.moving_points},
          {"moving_removed", cloud.moving_removed},
          {"cleaned_points", cloud.cleaned_points},
          {"points_not_finite", cloud.not_finite},
          {"distance", cloud.distance}};
}

}  // namespace

std::string qualityJson(const MapQuality& quality, const ClassTable& classes) {
  const SemanticQuality& s = quality.semantics;
  Json figures = dynamicsJson(quality.dynamics);
  figures.update({{"miou_map", s.map.meanIou()},
                  {"miou_input", s.input.meanIou()},
                  {"miou_map_present", s.map_of_present.meanIou()},
                  {"miou_input_present", s.input_of_present.meanIou()},
                  {"miou_map_occupied", s.map_of_occupied.meanIou()},
                  {"miou_input_occupied", s.input_of_occupied.meanIou()},
                  {"accuracy_map", s.map.accuracy()},
                  {"accuracy_input", s.input.accuracy()},
                  {"probability_calibration_error", s.probability.error()},
                  {"class_probability_calibration_error", s.class_probability.error()},
                  {"occupancy_calibration_error", quality.occupancy.error()},
                  {"sparsification_error", s.sparsification_error},
                  {"median_ms", quality.median.wall},
                  {"processor_ms", quality.median.processor},
                  {"yardstick_ms", quality.yardstick.wall},
                  {"yardstick_processor_ms", quality.yardstick.processor},
                  {"map_bytes", quality.bytes},
                  {"labels_not_in_table", quality.unknown_labels},
                  {"classes", Json::array()}});
  for (const SemanticClass& c : classes.classes()) {
    const auto voxels = quality.voxels_by_class.find(c.id);
    figures["voxels_by_class"][c.name] = voxels == quality.voxels_by_class.end() ? 0 : voxels->second;
    if (s.map.points(c.id) == 0) continue;
    figures["classes"].push_back({{"name", c.name},
                                  {"points", s.map.points(c.id)},
                                  {"iou_map", s.map.iou(c.id)},
                                  {"iou_input", s.input.iou(c.id)}});
  }
  figures["presence"] = presenceJson(quality.presence);
  addTraces(quality.traces, figures);
  figures["probability_reliability"] = reliabilityJson(s.probability);
  figures["class_probability_reliability"] = reliabilityJson(s.class_probability);
  figures["occupancy_reliability"] = reliabilityJson(quality.occupancy);
  for (const JudgedMap& judged : quality.judged) {
    figures["judged"].push_back(dynamicsJson(judged.dynamics));
    figures["judged"].back()["settings"] = judged.settings;
  }
  for (const OtherMap& other : quality.others) figures["also"].push_back(otherJson(other));
  for (const OctomapQuality& octomap : quality.octomaps) figures["octomap"].push_back(octomapJson(octomap));
  if (quality.cloud) figures["cloud"] = cloudJson(*quality.cloud);
  if (quality.truth) figures["truth"] = truthJson(*quality.truth, classes);
  return figures.dump(2) + "\n";
}

}  // namespace bki_mapping
