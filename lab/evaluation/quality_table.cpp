// The figures of evaluate_map as a table.
#include <cmath>
#include <iomanip>
#include <sstream>

#include "bki_mapping/core/named_parameter.h"
#include "evaluation/quality_report.h"
#include "evaluation/space_figures.h"

namespace bki_mapping {
namespace {

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

}  // namespace bki_mapping
