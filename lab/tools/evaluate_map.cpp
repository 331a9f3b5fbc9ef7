// Maps a labelled sequence and measures the quality of the map: static and moving objects, classes,
// calibration.
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <iterator>
#include <sstream>

#include "bki_mapping/core/named_parameter.h"
#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/sequence/sequence.h"
#include "core/atomic_file.h"
#include "core/counted.h"
#include "evaluation/left_out.h"
#include "evaluation/map_evaluation.h"
#include "evaluation/noise.h"
#include "evaluation/quality_report.h"
#include "journal/sensor_scan.h"
#include "settings/label_watch.h"
#include "simulation/drive_file.h"
#include "simulation/truth_cloud.h"
#include "tools/draw.h"
#include "tools/interruption.h"
#include "tools/sequence_options.h"
#include "tools/yardstick.h"

namespace {

using namespace bki_mapping;
namespace po = tools::po;

/// On simulated drives, ghosts are counted after every kGhostsEvery scans.
constexpr std::size_t kGhostsEvery = 10;

/// The parameters that change what the map says and not what is in it.
constexpr const char* kDecide[] = {"rules/stands_after", "rules/living_stands_after",
                                   "rules/fixed_stands_after", "rules/together"};
std::string decidingParameters() {
  std::string all = kDecide[0];
  for (std::size_t n = 1; n < std::size(kDecide); ++n) {
    all += (n + 1 < std::size(kDecide) ? ", " : " or ") + std::string(kDecide[n]);
  }
  return all;
}

po::options_description options() {
  const std::string judge =
      "also give SA and DA of the same map with other values of " + decidingParameters() + "; repeatable";
  const std::string without = "leave out one of the mapper's rules: " + namesOfRules() + "; repeatable";
  po::options_description options("Options");
  options.add_options()("json", po::value<std::string>()->value_name("FILE.json"),
                        "JSON file for the figures")(
      "errors", po::value<std::string>()->value_name("FILE.png"),
      "picture of the errors seen from above; FILE.csv lists them")(
      "late", tools::countOption("--late", 0)->value_name("N")->default_value(3),
      "voxels hit in the last N scans do not count for DA")(
      "label-noise", tools::realOption("--label-noise", 0.0, 1.0)->value_name("FRACTION")->default_value(0.0),
      "probability that a label is replaced by a wrong one")(
      "label-errors", po::value<std::string>()->value_name("KIND")->default_value("even"),
      "which labels --label-noise replaces: even, similar, objects, borders, far or network")(
      "label-error-seconds",
      tools::realOption("--label-error-seconds", 0.001, 3600.0)->value_name("S")->default_value(1.0),
      "how long whole objects keep their wrong label, with --label-errors objects or network [s]")(
      "predictions", po::value<std::string>()->value_name("FOLDER"),
      "name of a folder with predicted labels to map; those of --labels are the truth")(
      "write-predictions", po::value<std::string>()->value_name("FOLDER"),
      "name of a folder for the labels that are mapped, to be read by --predictions")(
      "pose-noise", po::value<std::string>()->value_name("M,DEG"),
      "standard deviations of errors added to each pose: along [m] and about [degrees] each axis")(
      "journal", tools::realOption("--journal", 1e-4, 1.0)->value_name("METRES"),
      "round points to multiples of this in the sensor's frame, as a journal does")(
      "pose-drift", po::value<std::string>()->value_name("M,DEG"),
      "the same for errors of each step from pose to pose, which add up")(
      "cloud", po::bool_switch(),
      "also compare the points in occupied voxels with a ground-truth cloud, as the DynamicMap benchmark "
      "does: "
      "gt_cloud.pcd beside pcd/, otherwise the labelled points of the scans")(
      "cloud-distance",
      tools::realOption("--cloud-distance", 0.0, 10.0)->value_name("M")->default_value(0.05),
      "distance within which points of the two clouds match [m]")(
      "octomap", po::value<std::vector<std::string>>()->composing()->value_name("NAME=VALUE,..."),
      "also map the same points with OctoMap, with these settings or the default ones of octomap_server, "
      "called default, and measure that map; repeatable")(
      "also", po::value<std::vector<std::string>>()->composing()->value_name("NAME=VALUE,..."),
      "also map the same scans with these settings, or without=RULE, and measure that map; repeatable")(
      "judge", po::value<std::vector<std::string>>()->composing()->value_name("NAME=VALUE,..."),
      judge.c_str())("without", po::value<std::vector<std::string>>()->composing()->value_name("RULE"),
                     without.c_str())(
      "noise-seed", tools::countOption("--noise-seed", 0)->value_name("N")->default_value(1),
      "seed of the errors");
  options.add(tools::sequenceOptions()).add(tools::mapperOptions());
  return options;
}

std::optional<PoseNoise> poseNoise(const po::variables_map& given) {
  if (given.count("pose-noise") && given.count("pose-drift")) {
    throw std::invalid_argument("--pose-noise and --pose-drift are both given; keep one");
  }
  const bool drifts = given.count("pose-drift");
  const std::string name = drifts ? "pose-drift" : "pose-noise";
  if (!given.count(name)) return std::nullopt;
  const std::string text = given[name].as<std::string>();
  std::istringstream in(text);
  double metres = -1.0, degrees = -1.0;
  char comma = 0;
  in >> metres >> comma >> degrees;
  if (!in || !(in >> std::ws).eof() || comma != ',' || !(metres >= 0.0) || !(degrees >= 0.0)) {
    throw std::invalid_argument("--" + name + " is " + text +
                                ", but must be two numbers M,DEG of at least 0, such as 0.05,0.3");
  }
  return PoseNoise(drifts ? PoseNoise::Kind::kDrift : PoseNoise::Kind::kWhite, metres,
                   degrees * 3.14159265358979323846 / 180.0, tools::count(given, "noise-seed"));
}

/// @throws std::invalid_argument if the sequence, or what is mapped of it, has no such measure.
std::optional<CloudEvaluation> cloudEvaluation(const po::variables_map& given, const Sequence& sequence,
                                               const MapperConfig& config) {
  if (!given["cloud"].as<bool>()) return std::nullopt;
  const double distance = given["cloud-distance"].as<double>();
  if (sequence.layout() != SequenceLayout::kDynamicMap) {
    if (config.label_values == LabelValues::kId) {
      throw std::invalid_argument(
          "--cloud needs raw labels, because class ids do not say what moves; leave out "
          "label_values=id");
    }
    if (!sequence.labelled()) {
      throw std::invalid_argument("--cloud needs labels, which say what moves; " + sequence.folder() +
                                  " is read without labels; give --labels FOLDER, or leave out --cloud");
    }
    return CloudEvaluation(std::nullopt, distance);
  }
  if (given["first"].as<std::int64_t>() > 0 || given.count("scans") || given.count("pose-drift")) {
    throw std::invalid_argument(
        "--cloud compares with the cloud of all scans at their poses; leave out --first, --scans and "
        "--pose-drift");
  }
  const std::filesystem::path file = std::filesystem::path(sequence.folder()) / "gt_cloud.pcd";
  if (!std::filesystem::exists(file)) {
    throw std::invalid_argument(
        "--cloud needs " + file.string() +
        ", a cloud of all scans whose points of moving objects have intensity 1; it is missing");
  }
  return CloudEvaluation(readTruthCloud(file.string()), distance);
}

void drawErrors(const std::string& picture, const std::string& rows) {
  const std::filesystem::path path(picture);
  const std::string table = std::filesystem::path(path).replace_extension(".csv").string();
  writeTextFile(table, rows);
  tools::draw("plot_errors.py", {table, picture});
}

/// Other settings by which to decide the states of the same map.
struct Judgement {
  std::string settings;
  MapperConfig config;
};

/// @throws std::invalid_argument if settings change more than decisions.
std::vector<Judgement> judgements(const po::variables_map& given, const MapperConfig& config) {
  std::vector<Judgement> all;
  if (!given.count("judge")) return all;
  for (const std::string& settings : given["judge"].as<std::vector<std::string>>()) {
    std::istringstream names(settings);
    for (std::string name; std::getline(names, name, ',');) {
      const std::string changed = name.substr(0, name.find('='));
      if (std::find(std::begin(kDecide), std::end(kDecide), changed) != std::end(kDecide)) continue;
      throw std::invalid_argument("--judge " + settings + " changes more than decisions; give it " +
                                  decidingParameters() + " only");
    }
    all.push_back({settings, tools::withSettings(config, "--judge", settings)});
  }
  return all;
}

/// A scan as a journal keeps it.
Scan asKept(const Scan& scan, const SequenceFrame& frame, const po::variables_map& given,
            const SemanticMapper& mapper) {
  const RoundedScan rounded =
      toSensorScan(scan, frame.T_map_sensor, given["journal"].as<double>(), mapper.config().sensor_model);
  return place(rounded.scan, rounded.T_map_sensor);
}

/// Settings of another map of the same scans.
/// @param settings NAME=VALUE,..., of which without=RULE leaves out a rule.
/// @throws std::invalid_argument if its grid would be another one, or settings are wrong.
MapperConfig otherConfig(const MapperConfig& config, const std::string& settings) {
  const std::string kWithout = "without=";
  std::string values;
  std::vector<std::string> rules;
  std::istringstream in(settings);
  for (std::string each; std::getline(in, each, ',');) {
    if (each.rfind(kWithout, 0) == 0) {
      rules.push_back(each.substr(kWithout.size()));
    } else {
      values += (values.empty() ? "" : ",") + each;
    }
  }
  MapperConfig other = tools::withSettings(config, "--also", values);
  if (other.resolution != config.resolution || other.label_values != config.label_values) {
    throw std::invalid_argument(
        "--also " + settings +
        " changes resolution or label_values, by which the map is measured; measure such "
        "a map in a run of its own");
  }
  for (const std::string& rule : rules) other = withoutRule(other, rule);
  return other;
}

MapperConfig configOf(const po::variables_map& given) {
  MapperConfig config = tools::mapperConfig(given);
  if (!given.count("without")) return config;
  for (const std::string& rule : given["without"].as<std::vector<std::string>>()) {
    config = withoutRule(config, rule);
  }
  return config;
}

int evaluate(const po::variables_map& given) {
  const tools::Interruption interruption;
  SemanticMapper mapper(configOf(given), tools::classTable(given));
  const std::vector<Judgement> others = judgements(given, mapper.config());
  const Sequence sequence = tools::openSequence(given);
  const auto [first, last] = tools::frameRange(given, sequence);
  tools::warnOfPoses(given, first, last);
  const LabelNoise label_noise{given["label-noise"].as<double>(),
                               labelErrorsNamed(given["label-errors"].as<std::string>()),
                               tools::count(given, "noise-seed"), given["label-error-seconds"].as<double>()};
  std::optional<PoseNoise> pose_noise = poseNoise(given);
  std::optional<Sequence> predictions;
  if (given.count("predictions")) {
    SequenceOptions options = tools::sequenceOptionsOf(given);
    options.labels = given["predictions"].as<std::string>();
    predictions.emplace(sequence.folder(), options);
  }
  std::optional<LabelWriter> label_writer;
  if (given.count("write-predictions"))
    label_writer.emplace(sequence.folder(), given["write-predictions"].as<std::string>());
  if (given.count("errors") &&
      std::filesystem::path(given["errors"].as<std::string>()).extension() != ".png") {
    throw std::invalid_argument("--errors must end in .png");
  }
  for (const char* file : {"json", "errors"}) {
    if (given.count(file)) checkWritable(given[file].as<std::string>());
  }
  const GridGeometry& geometry = mapper.map().geometry();
  const auto moving = KittiLabels::moving();
  MapEvaluation evaluation(geometry, moving, last - first, tools::count(given, "late"),
                           cloudEvaluation(given, sequence, mapper.config()));
  if (given.count("octomap")) {
    for (const std::string& settings : given["octomap"].as<std::vector<std::string>>())
      evaluation.octomaps.emplace_back(settings, geometry, moving);
  }
  if (given.count("also")) {
    for (const std::string& settings : given["also"].as<std::vector<std::string>>()) {
      evaluation.others.emplace_back(settings, otherConfig(mapper.config(), settings),
                                     tools::classTable(given), moving);
    }
  }
  std::optional<simulation::Drive> drive;
  const auto config = simulation::readDriveFile(given["sequence"].as<std::string>());
  if (config) evaluation.traces.emplace(geometry);
  // A map that drifts is in no frame of the true scene.
  if (config && !given.count("pose-drift")) {
    drive.emplace(*config);
    evaluation.truth.emplace(simulation::VoxelTruth::of(*drive, geometry), mapper.classes());
    evaluation.tellTruth();
  }
  ScanTimes times, yardstick;
  std::size_t done = 0;  // scans
  LabelWatch watch;
  bool ends = interruption.requested();
  if (ends) throw tools::Stopped("stopped before the first scan; nothing was written");
  for (std::size_t i = first; !ends; ++i) {
    SequenceFrame frame = sequence.read(i);
    yardstick.add(tools::yardstick(frame));
    Scan scan = frame.scan();
    if (pose_noise) frame.T_map_sensor = pose_noise->next(frame.T_map_sensor);
    Scan input = frame.scan();
    if (given.count("pose-drift")) scan = input;
    scan.labels_are_ids = input.labels_are_ids = mapper.config().label_values == LabelValues::kId;
    if (predictions) input.labels = predictions->read(i).labels;
    input.labels = withLabelNoise(input, mapper.classes(), label_noise);
    if (label_writer) label_writer->write(sequence.name(i), input.labels);
    const Scan mapped = given.count("journal") ? asKept(input, frame, given, mapper) : input;
    ScanTimer timer;
    const ScanStats stats = mapper.integrate(mapped);
    times.add({stats.totalMs(), timer.elapsed().processor});
    ++done;
    if (evaluation.traces) {
      MapOccupants occupants(mapper.map(), mapper.rules());
      evaluation.traces->add(scan, occupants);
    }
    for (OtherRun& other : evaluation.others) other.mapper.integrate(mapped);
    for (OctomapRun& octomap : evaluation.octomaps) {
      octomap.times.add(octomap.mapper.integrate(input));
      if (evaluation.traces) octomap.traces.add(scan, octomap.mapper);
    }
    std::vector<std::uint32_t> predicted = input.labels;
    if (evaluation.traces) removeNothing(simulation::isNothing, scan, predicted);  // the rest is there
    for (OctomapRun& octomap : evaluation.octomaps) {
      if (sequence.labelled()) octomap.presence.add(scan, mapper.classes(), octomap.mapper);
    }
    tools::warn(watch.report(mapper, input, stats.counts));
    if (sequence.labelled()) {
      evaluation.add(scan, predicted, mapper.classes());
      MapOccupants occupants(mapper.map(), mapper.rules());
      evaluation.presence.add(scan, mapper.classes(), occupants);
      for (OtherRun& other : evaluation.others) {
        MapOccupants its(other.mapper.map(), other.mapper.rules());
        other.presence.add(scan, mapper.classes(), its);
      }
    } else {
      evaluation.addUnlabelled(scan, mapper.classes());
    }
    ends = i + 1 == last || interruption.requested();
    if (drive) {
      evaluation.end = drive->timeOf(sequence.number(i));
      const bool count = done % kGhostsEvery == 0 || ends;
      if (count) evaluation.truth->countGhosts(mapper.map(), mapper.rules(), evaluation.end);
    }
    tools::showProgress(done, last - first, "");
  }
  const bool stopped = done < last - first;
  if (stopped) evaluation.dynamics.end();
  if (stopped && sequence.layout() == SequenceLayout::kDynamicMap && evaluation.cloud) {
    evaluation.cloud.reset();
    std::cerr << "evaluate_map: the ground-truth cloud covers all scans, so the map of these is not compared "
                 "with it\n";
  }
  MapQuality quality = evaluation.compare(mapper);
  quality.median = times.median();
  quality.yardstick = yardstick.median();
  quality.labels_are_ids = mapper.config().label_values == LabelValues::kId;
  const std::string errors = given.count("errors") ? evaluation.errorRows(mapper) : "";
  for (const Judgement& other : others) {
    mapper.reconfigure(other.config);
    quality.judged.push_back(
        {other.settings, evaluation.dynamics.compare(mapper.map(), mapper.rules(), evaluation.taken())});
  }
  std::cout << qualityTable(quality, mapper.classes());
  if (given.count("json")) {
    writeTextFile(given["json"].as<std::string>(), qualityJson(quality, mapper.classes()));
  }
  if (given.count("errors")) {
    const std::string picture = given["errors"].as<std::string>();
    drawErrors(picture, errors);
    int number = 0;
    for (OctomapRun& octomap : evaluation.octomaps) {
      const std::string name =
          std::filesystem::path(picture).stem().string() + "_octomap_" + std::to_string(++number) + ".csv";
      writeTextFile(std::filesystem::path(picture).replace_filename(name).string(),
                    evaluation.fateRows(geometry, octomap.mapper));
    }
  }
  if (stopped) {
    throw tools::Stopped("stopped after scan " + sequence.name(first + done - 1) +
                         "; all figures are of the first " + std::to_string(done) + " of " +
                         counted(last - first, "scan"));
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return tools::run(argc, argv, "evaluate_map", "Maps a sequence and measures the quality of the map.",
                    options(), evaluate);
}
