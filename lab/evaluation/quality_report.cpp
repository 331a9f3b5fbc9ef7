#include "evaluation/quality_report.h"

#include <cmath>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <sstream>

#include "bki_mapping/core/named_parameter.h"

namespace bki_mapping {
namespace {

using Json = nlohmann::json;

/// The figures of SpaceQuality by name.
struct SpaceFigure {
  const char* name;
  Proportion SpaceQuality::*proportion;
  const char* meaning;
};
constexpr SpaceFigure kSpaceFigures[] = {
    {"free_precision", &SpaceQuality::free_precision, "of the voxels free in the map are mostly empty"},
    {"free_empty", &SpaceQuality::free_empty, "of the same have nothing in them"},
    {"free_recall", &SpaceQuality::free_recall, "of the empty voxels that beams crossed are free in the map"},
    {"occupied_precision", &SpaceQuality::occupied_precision,
     "of the voxels occupied in the map have something in them"},
    {"occupied_near", &SpaceQuality::occupied_near,
     "of the same have something in them or within a voxel's edge"},
    {"occupied_recall", &SpaceQuality::occupied_recall,
     "of the non-empty voxels that were hit are occupied in the map"},
};

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

/// One decimal; "-" for a fraction of nothing.
std::string figureText(double figure) {
  if (!std::isfinite(figure)) return "-";
  std::ostringstream text;
  text << std::fixed << std::setprecision(1) << figure;
  return text.str();
}

/// Such as "up to 20 m".
std::string distanceText(std::size_t bin) {
  const auto& ends = TruthQuality::kDistances;
  return bin < ends.size() ? "up to " + numberText(ends[bin]) + " m" : "beyond";
}

class Table {
 public:
  /// A line of cells of equal width, after the first.
  template <typename Text>
  void row(const std::string& name, std::size_t cells, const Text& text) {
    out_ << std::left << std::setw(22) << name << std::right;
    for (std::size_t i = 0; i < cells; ++i) out_ << std::setw(12) << text(i);
    out_ << "\n";
  }
  void percent(const std::string& name, double fraction, const std::string& meaning) {
    out_ << std::left << std::setw(22) << name << std::right << std::setw(6) << figureText(100.0 * fraction)
         << " %  " << meaning << "\n";
  }
  void text(const std::string& line) { out_ << line << "\n"; }
  std::string str() const { return out_.str(); }

 private:
  std::ostringstream out_;
};

std::string delayText(const Delays& delays) {
  const auto text = [](double seconds) { return std::isinf(seconds) ? "never" : figureText(seconds) + " s"; };
  return "median " + text(delays.quantile(0.5)) + ", 95 % within " + text(delays.quantile(0.95)) + "; " +
         std::to_string(delays.never) + " of " + std::to_string(delays.count()) + " voxels never";
}

void addPresence(const PresenceQuality& presence, Table& table) {
  for (std::size_t bin = 0; bin < PresenceQuality::kDistances.size(); ++bin) {
    const std::string within = " within " + numberText(PresenceQuality::kDistances[bin]) + " m";
    table.percent(
        "PA moving", presence.moving[bin].accuracy(),
        "of each scan's points of moving objects" + within + " are in occupied voxels right after it");
    table.percent("   standing", presence.standing[bin].accuracy(),
                  "of those of objects that could move, but stand still");
  }
  table.percent("   named", presence.moving.back().namedShare(),
                "of the moving points in occupied voxels are in one with a class that the scan hit in it");
  if (presence.stayed > 0) {
    table.percent("PA stayed", presence.stayedShare(),
                  "of the voxels into which something moved and stayed are occupied at the end");
  }
  table.text("to appear: " + delayText(presence.appear));
  table.text("to clear, once beams come near again: " + delayText(presence.clear));
}

std::string tracesText(const TraceQuality& traces, const std::string& what) {
  const auto percent = [](const Traces& part) { return figureText(100.0 * part.fraction()); };
  std::string text = std::to_string(traces.points) + " of " + std::to_string(traces.all_points) +
                     " points are of " + what + "; in occupied voxels after 1 s, after 10 s, at the end [%]:";
  for (std::size_t bin = 0; bin < TraceQuality::kDistances.size(); ++bin) {
    const TraceQuality::UpTo& near = traces.up_to[bin];
    text += " within " + numberText(TraceQuality::kDistances[bin]) + " m " + percent(near.after[0]) + ", " +
            percent(near.after[1]) + ", " + percent(near.at_end) + ";";
  }
  text.pop_back();
  return text;
}

void addTraces(const std::optional<TracesOfKinds>& traces, Table& table) {
  if (!traces) return;
  if (traces->particles.points > 0) table.text(tracesText(traces->particles, "particles"));
  if (traces->images.points > 0) table.text(tracesText(traces->images, "images in panes"));
}

std::string accuraciesText(const DynamicsQuality& quality) {
  const auto percent = [](double fraction) { return figureText(100.0 * fraction); };
  return "SA " + percent(quality.staticAccuracy()) + ", standing " + percent(quality.standingAccuracy()) +
         ", holes " + percent(quality.holes()) + ", DA " + percent(quality.dynamicAccuracy()) + ", AA " +
         percent(quality.accuracy());
}

void addOctomap(const OctomapQuality& octomap, Table& table) {
  const auto percent = [](double fraction) { return figureText(100.0 * fraction); };
  table.text("OctoMap of the same scans, " + octomap.settings + ": " + accuraciesText(octomap.dynamics) +
             ", PA moving within 50 m " + percent(octomap.presence.moving.back().accuracy()) +
             ", PA stayed " + percent(octomap.presence.stayedShare()) + "; to appear: " +
             delayText(octomap.presence.appear) + "; to clear: " + delayText(octomap.presence.clear) +
             "; ECE occupancy " + percent(octomap.occupancy.error()) +
             (octomap.truth ? "; free_precision " + percent(octomap.truth->all.free_precision.fraction()) +
                                  ", free_recall " + percent(octomap.truth->all.free_recall.fraction())
                            : "") +
             "; " + std::to_string(octomap.bytes) + " bytes; median " + figureText(octomap.median.wall) +
             " ms a scan");
  addTraces(octomap.traces, table);
}

void addCloud(const CloudQuality& cloud, Table& table) {
  const std::string distance = numberText(cloud.distance) + " m";
  table.text("as the DynamicMap benchmark counts, with the " + std::to_string(cloud.cleaned_points) +
             " points in occupied voxels as the cleaned cloud:");
  table.percent("  SA", cloud.staticAccuracy(),
                "of the static points of the truth have a cleaned point within " + distance);
  table.percent("  DA", cloud.dynamicAccuracy(), "of its moving points have none");
  table.percent("  AA", cloud.accuracy(), "sqrt(SA DA)");
  table.percent("  HA", cloud.harmonicAccuracy(), "2 SA DA / (SA + DA)");
  table.text("  " + std::to_string(cloud.static_points) + " static and " +
             std::to_string(cloud.moving_points) + " moving points of the truth" +
             (cloud.not_finite == 0
                  ? ""
                  : "; " + std::to_string(cloud.not_finite) + " that are not finite do not count"));
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

void addTruth(const TruthQuality& truth, const ClassTable& classes, Table& table) {
  for (const SpaceFigure& figure : kSpaceFigures) {
    table.percent(figure.name, (truth.all.*figure.proportion).fraction(), figure.meaning);
  }
  const auto& bins = truth.by_distance;
  table.row("by distance [%]", bins.size(), distanceText);
  for (const SpaceFigure& figure : kSpaceFigures) {
    table.row(std::string("  ") + figure.name, bins.size(),
              [&](std::size_t bin) { return figureText(100.0 * (bins[bin].*figure.proportion).fraction()); });
  }
  table.percent("voxel mIoU", truth.meanIou(classes),
                "of the classes of voxels, over the classes that occur");
  table.percent("voxel IoU", truth.occupiedIou(classes), "of occupied voxels, whatever their class");
  table.percent("ECE true occupancy", truth.occupancy.error(),
                "ECE occupancy by the scene instead of by the points");
  table.text(std::to_string(truth.ghosts) + " ghosts among " + std::to_string(truth.movable) +
             " voxels of classes that can move (nothing movable near for 0.5 s); " +
             figureText(truth.mean_ghosts) + " on average while mapping");
}

}  // namespace

std::string qualityTable(const MapQuality& quality, const ClassTable& classes) {
  const DynamicsQuality& d = quality.dynamics;
  const SemanticQuality& s = quality.semantics;
  Table table;
  table.percent("SA", d.staticAccuracy(), "of the points of static objects are in occupied voxels");
  table.percent("  ground", d.groundAccuracy(), "of the points of ground");
  table.percent("  standing", d.standingAccuracy(),
                "of the points of objects that could move, but stand still");
  table.percent("  other", d.otherAccuracy(), "of the other static points");
  table.percent("holes", d.holes(), "of the voxels with points of ground are not occupied");
  table.percent("DA", d.dynamicAccuracy(),
                "of the early points of moving objects are in voxels that are not occupied");
  table.percent("  decidable", d.decidableAccuracy(),
                "of those in voxels that share no static point and that beams came near again");
  table.percent("  entered", d.enteredAccuracy(), "of those in voxels that beams entered again");
  table.percent("AA", d.accuracy(), "sqrt(SA DA)");
  table.percent("HA", d.harmonicAccuracy(), "2 SA DA / (SA + DA)");
  addPresence(quality.presence, table);
  addTraces(quality.traces, table);
  table.percent("mIoU of the map", s.map.meanIou(), "at the labelled points");
  table.percent("mIoU of the input", s.input.meanIou(), "of the labels given to the mapper");
  table.percent("  present: map", s.map_of_present.meanIou(), "without the points of what has moved away");
  table.percent("  present: input", s.input_of_present.meanIou(),
                "the same of the labels given to the mapper");
  table.percent("  occupied: map", s.map_of_occupied.meanIou(), "of these, at the points in occupied voxels");
  table.percent("  occupied: input", s.input_of_occupied.meanIou(),
                "the same of the labels given to the mapper");
  table.percent("ECE probability", s.probability.error(),
                "expected calibration error of p, in which the class and free share");
  table.percent("ECE class_probability", s.class_probability.error(),
                "the same of the probability of the class, given that something is there");
  table.percent("ECE occupancy", quality.occupancy.error(),
                "the same of the probability that something is in a voxel, by the points");
  table.percent("AUSE", s.sparsification_error, "area under the sparsification error curve, by variance");
  if (quality.truth) addTruth(*quality.truth, classes, table);
  if (quality.cloud) addCloud(*quality.cloud, table);
  table.text(std::to_string(d.static_points) + " points of static and " + std::to_string(d.moving_points) +
             " of moving objects; " + std::to_string(quality.bytes) + " bytes; median " +
             figureText(quality.median.wall) + " ms a scan");
  for (const OctomapQuality& octomap : quality.octomaps) addOctomap(octomap, table);
  for (const JudgedMap& judged : quality.judged)
    table.text("with " + judged.settings + ": " + accuraciesText(judged.dynamics));
  for (const OtherMap& other : quality.others) {
    table.text("also mapped with " + other.settings + ": " + accuraciesText(other.dynamics) +
               ", PA moving within 50 m " + figureText(100.0 * other.presence.moving.back().accuracy()));
  }
  if (quality.labels_are_ids) {
    table.text("class ids do not say what moves, so DA and AA are unknown and all points count as static");
  } else if (d.moving_points == 0) {
    table.text("no point is of a moving object (raw labels 252 to 259), so DA and AA are unknown");
  }
  if (quality.unknown_labels > 0) {
    table.text(std::to_string(quality.unknown_labels) + " of " + std::to_string(quality.labels) +
               " labels are not in the class table " + classes.name() + ", as " +
               (quality.labels_are_ids ? "id " : "raw number ") + std::to_string(quality.unknown_label) +
               ", and do not count; check --classes and --set label_values");
  }
  return table.str();
}

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
