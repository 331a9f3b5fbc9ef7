// Maps the clouds of bags without playing them: reads clouds and tf as fast as the mapper takes them. Needs
// no master.
#include <ros/time.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <memory>
#include <set>
#include <sstream>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/settings/yaml.h"
#include "core/atomic_file.h"
#include "core/counted.h"
#include "export/ordered_json.h"
#include "journal/kept_scans.h"
#include "ros/recording_mapper.h"
#include "ros/server_config.h"
#include "tools/bag_reading.h"
#include "tools/interruption.h"
#include "tools/map_output.h"
#include "tools/run_report.h"

namespace {

using namespace bki_mapping;
using ros_interface::InputConfig;
using ros_interface::RecordingMapper;
namespace po = tools::po;

po::options_description options() {
  po::options_description options("Options");
  options.add_options()("cloud-topic",
                        po::value<std::vector<std::string>>()->value_name("TOPIC")->composing(),
                        "topic of labelled clouds (sensor_msgs/PointCloud2); repeatable")(
      "frame", tools::textOption("FRAME"), "the map frame, to which tf must lead (default: map)")(
      "frame-in-file", tools::textOption("FRAME"),
      "name of the map frame in the map file (default: as in tf)")(
      "label-field", tools::textOption("FIELD"), "field of the cloud with the label (default: label)")(
      "resolution", tools::textOption("M"), "edge length of a voxel, as --set resolution=M")(
      "first", tools::countOption("--first", 0)->value_name("N"), "number of the first cloud (default: 0)")(
      "scans", tools::countOption("--scans", 1)->value_name("N"), "number of clouds (default: all)")(
      "start", tools::realOption("--start", 0.0)->value_name("S"),
      "begin so many seconds after the first cloud")("duration",
                                                     tools::realOption("--duration", 0.0)->value_name("S"),
                                                     "and read so many seconds of clouds")(
      "drive", tools::textOption("ID"),
      "id of these clouds in the map file (default: name of the bag, first and last cloud)")(
      "report", tools::textOption("FILE.json"), "report of the run")(
      "trajectory", tools::textOption("FILE.txt"), "poses of the sensor, with stamps")(
      "allow-empty", po::bool_switch(), "write the map even if no cloud has a transform")(
      "print-topics", po::bool_switch(), "print the topics with clouds, and the number of clouds, and exit");
  tools::addMapOutput(options);
  tools::addJournal(options);
  options.add(tools::mapperOptions());
  return options;
}

/// The settings of a node: from --config, --set, and the options that stand for parameters.
std::pair<ros_interface::ServerConfig, MapperConfig> settings(const po::variables_map& given) {
  std::map<std::string, std::string> values = tools::givenSettings(given);
  const auto take = [&](const std::string& option, const std::string& parameter) {
    if (given.count(option) == 0 || given[option].defaulted()) return;
    if (!values.emplace(parameter, given[option].as<std::string>()).second) {
      throw std::invalid_argument("parameter " + parameter + " is given by --" + option +
                                  " and by --set; keep one");
    }
  };
  take("classes", "classes");
  take("frame", "frame_id");
  take("label-field", "label_field");
  take("resolution", "resolution");
  if (given.count("config")) values.merge(loadParameterFile(given["config"].as<std::string>()));
  if (values.count("config") > 0) {
    throw std::invalid_argument("parameter config names a file of parameters; give it with --config");
  }
  std::pair<ros_interface::ServerConfig, MapperConfig> both;
  ros_interface::setParameters(values, both.first, both.second);
  return both;
}

/// What keeps the scans of a mapper; nullptr if nothing asks for it.
std::unique_ptr<KeptScans> keptScans(const po::variables_map& given,
                                     const ros_interface::ServerConfig& server, SemanticMapper& mapper) {
  if (given.count("journal") == 0 && !server.correction.journal) return nullptr;
  MapCorrector::Settings settings;
  settings.quantum =
      given.count("journal") ? given["journal"].as<double>() : server.correction.journal_quantum;
  return std::make_unique<KeptScans>(mapper, settings);
}

/// The inputs, with their topics as the bags name them.
std::vector<InputConfig> inputs(const po::variables_map& given, const ros_interface::ServerConfig& server,
                                const MapperConfig& mapper, const tools::BagFiles& bags) {
  std::vector<InputConfig> inputs = allInputs(server, mapper);
  if (given.count("cloud-topic") > 0) {
    if (!server.inputs.empty()) {
      throw std::invalid_argument(
          "--cloud-topic is given, but the parameters below inputs/ name topics; keep one");
    }
    const InputConfig common = inputs.front();
    inputs.clear();
    for (const std::string& topic : given["cloud-topic"].as<std::vector<std::string>>()) {
      inputs.push_back(common);
      inputs.back().topic = topic;
    }
  }
  std::set<std::string> topics;
  for (InputConfig& input : inputs) {
    input.topic = bags.cloudTopic(input.topic, "--cloud-topic TOPIC");
    if (!topics.insert(input.topic).second) {
      throw std::invalid_argument("topic " + input.topic +
                                  " is named twice, and its clouds would count twice; name it once");
    }
  }
  return inputs;
}

/// The clouds that the options select.
tools::CloudRange rangeOf(const po::variables_map& given, const tools::BagReading& reading) {
  const std::vector<ros::Time>& times = reading.times();
  for (const auto& [a, b] : {std::pair("first", "start"), std::pair("scans", "duration")}) {
    if (given.count(a) == 0 || given.count(b) == 0) continue;
    throw std::invalid_argument("--" + std::string(a) + " and --" + b +
                                " say the same in clouds and in seconds; keep one");
  }
  const auto numberAt = [&](double seconds, const ros::Time& from) {
    const auto later = [&](const ros::Time& time, double s) { return time.toSec() - from.toSec() < s; };
    return static_cast<std::size_t>(std::lower_bound(times.begin(), times.end(), seconds, later) -
                                    times.begin());
  };
  tools::CloudRange range{0, times.size()};
  if (given.count("first")) range.first = tools::count(given, "first");
  if (given.count("start") && !times.empty())
    range.first = numberAt(given["start"].as<double>(), times.front());
  if (range.first >= times.size()) {
    throw std::invalid_argument("the bags have " + counted(times.size(), "cloud") +
                                " on these topics, so none is left; " + "begin earlier, or record clouds");
  }
  if (given.count("scans")) range.last = std::min(range.last, range.first + tools::count(given, "scans"));
  if (given.count("duration")) range.last = numberAt(given["duration"].as<double>(), times[range.first]);
  range = reading.cuttable(range);
  if (range.first >= range.last) throw std::invalid_argument("these options select no cloud; ask for more");
  return range;
}

std::string numbers(const tools::CloudRange& range) {
  return sixDigits(range.first) + "-" + sixDigits(range.last - 1);
}

/// Why clouds were dropped for another reason than that tf lacks the pose, or that they are empty; "" if none
/// was.
std::string faultOf(const RecordingMapper& recording) {
  using R = ros_interface::DropReason;
  for (const R fault : {R::kBadCloud, R::kBadTransform, R::kTooLarge, R::kMemory}) {
    const auto found = recording.drops().find(fault);
    if (found != recording.drops().end()) return found->second;
  }
  return "";
}

/// A pose as in the TUM RGB-D benchmark.
std::string poseLine(const ros_interface::PlacedScan& placed) {
  const Eigen::Vector3d at = placed.T_map_sensor.translation();
  const Eigen::Quaterniond q(placed.T_map_sensor.linear());
  const ros::Time stamp = ros::Time().fromNSec(placed.scan.stamp);
  char line[300];
  std::snprintf(line, sizeof line, "%u.%09u %.9g %.9g %.9g %.9g %.9g %.9g %.9g\n", stamp.sec, stamp.nsec,
                at.x(), at.y(), at.z(), q.x(), q.y(), q.z(), q.w());
  return line;
}

/// The report of map_sequence, with what became of the clouds.
std::string reportText(const SemanticMapper& mapper, const std::vector<tools::ScanReport>& scans,
                       const MappingStatus& status) {
  auto report = OrderedJson::parse(tools::reportJson(mapper, scans));
  report["clouds"] = {{"read", status.received}, {"mapped", status.integrated}};
  for (const ros_interface::DropKind& kind : ros_interface::dropKinds()) {
    if (status.*kind.count > 0) report["clouds"]["dropped"][kind.name] = status.*kind.count;
  }
  return report.dump(2) + "\n";
}

std::string stoppedText(const po::variables_map& given, const tools::CloudRange& done, std::size_t last) {
  const std::string count = std::to_string(done.size());
  const std::string text = "stopped after cloud " + sixDigits(done.last - 1) + ", " + count + " of " +
                           counted(last - done.first, "cloud");
  if (!tools::writesMapFile(given)) return text;
  return text + "; to map the rest, say --first " + std::to_string(done.last) + " --scans " +
         std::to_string(last - done.last) + " with another --output, and add both with merge_maps";
}

/// What there is to report of a run.
struct Run {
  std::vector<tools::ScanReport> scans;
  std::string trajectory;
};

RecordingMapper::Listener listenerOf(Run& run) {
  RecordingMapper::Listener listener;
  listener.warn = tools::warn;
  listener.inform = [](const std::string& sentence) { std::cerr << sentence << "\n"; };
  listener.mapped = [&](const ros_interface::PlacedScan& placed, const ScanStats& stats) {
    run.scans.push_back({std::to_string(placed.scan.stamp), stats});
    run.trajectory += poseLine(placed);
  };
  listener.forgotten = [&] { run = {}; };
  return listener;
}

/// What the progress bar says.
std::string progressText(const Run& run) {
  std::ostringstream text;
  if (!run.scans.empty()) {
    text << std::fixed << std::setprecision(1) << run.scans.back().stats.totalMs() << " ms";
  }
  return text.str();
}

/// Writes the map, and the other files that are asked for. @param drive of the clouds, without scans if none
/// was mapped. @param kept the scans; may be nullptr. @param frame of the map, in tf.
void write(const po::variables_map& given, const SemanticMapper& mapper, const Run& run,
           const DriveRecord& drive, const KeptScans* kept, const std::string& frame,
           const MappingStatus& status) {
  std::vector<DriveRecord> drives;
  if (drive.scans > 0) drives.push_back(drive);
  JournalOutput journal;
  journal.kept = kept;
  journal.drive = drive.id;
  tools::writeMap(given, mapper,
                  given.count("frame-in-file") ? given["frame-in-file"].as<std::string>() : frame, drives,
                  std::move(journal));
  if (given.count("report")) {
    writeTextFile(given["report"].as<std::string>(), reportText(mapper, run.scans, status));
  }
  if (given.count("trajectory")) writeTextFile(given["trajectory"].as<std::string>(), run.trajectory);
}

int printTopics(const tools::BagFiles& bags) {
  for (const auto& [topic, count] : bags.cloudTopics()) std::cout << topic << " " << count << "\n";
  return 0;
}

/// @throws std::invalid_argument if a file that is to be written is one of the bags.
void checkIsNoBag(const std::string& option, const std::string& path, const po::variables_map& given) {
  for (const std::string& bag : given["files"].as<std::vector<std::string>>()) {
    std::error_code missing;
    if (std::filesystem::equivalent(path, bag, missing)) {
      throw std::invalid_argument("--" + option + " " + path + " would replace the bag; name another file");
    }
  }
}

int mapBag(const po::variables_map& given) {
  if (given.count("files") == 0) throw std::invalid_argument("name one or more bags (see --help)");
  const tools::BagFiles bags(given["files"].as<std::vector<std::string>>());
  if (given["print-topics"].as<bool>()) return printTopics(bags);
  const auto [server, config] = settings(given);
  tools::checkMapOutput(given);
  for (const char* file : {"report", "trajectory"}) {
    if (given.count(file)) checkWritable(given[file].as<std::string>());
  }
  for (const char* file : {"output", "report", "trajectory"}) {
    if (given.count(file)) checkIsNoBag(file, given[file].as<std::string>(), given);
  }
  const tools::Interruption interruption;
  const auto classes = std::make_shared<const ClassTable>(loadClassTable(server.classes));
  for (const std::string& warning : settingWarnings(config, *classes)) tools::warn(warning);
  SemanticMapper mapper(config, classes);
  std::vector<std::string> topics;
  const std::vector<InputConfig> from = inputs(given, server, config, bags);
  for (const InputConfig& input : from) {
    topics.push_back(input.topic);
    tools::warn(ros_interface::InputNotes(input.topic).ofSettings(input, *classes));
  }

  Run run;
  const std::unique_ptr<KeptScans> kept = keptScans(given, server, mapper);
  RecordingMapper recording(mapper, server, from, listenerOf(run), kept.get());
  tools::BagReading reading(bags, topics, recording);
  const tools::CloudRange range = rangeOf(given, reading);
  const tools::CloudRange done = reading.map(range, interruption, [&](std::size_t count) {
    tools::showProgress(count, range.size(), progressText(run));
  });
  if (done.size() == 0) throw tools::Stopped("stopped before the first cloud; nothing was written");
  const std::string counts = recording.ledger().summary(0), fault = faultOf(recording);
  if (run.scans.empty() && !(given["allow-empty"].as<bool>() && fault.empty())) {
    std::string why = fault;
    if (why.empty() && !recording.drops().empty()) why = recording.drops().begin()->second;
    if (why.empty()) why = "the map was reset after the last cloud";
    throw std::runtime_error("no cloud was mapped, and nothing was written: " + why + " (" + counts + ")");
  }
  DriveRecord drive = recording.drive();
  drive.id = given.count("drive") ? given["drive"].as<std::string>() : bags.names() + "/" + numbers(done);
  drive.name = bags.text();
  if (kept) kept->finish();
  write(given, mapper, run, drive, kept.get(), server.frame_id,
        recording.ledger().status(ros_interface::ScanLedger::Clock::now(), 0));
  std::cout << counts << "\n" << tools::summaryText(mapper, run.scans);
  if (kept) std::cout << tools::summaryText(*kept);
  if (done.last < range.last) throw tools::Stopped(stoppedText(given, done, range.last));
  if (fault.empty()) return 0;
  std::cerr << "map_bag: not all clouds could be mapped: " << fault << " (" << counts << ")\n";
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  ros::Time::init();
  return tools::run(
      argc, argv, "map_bag",
      "Maps the clouds of bags without playing them, as the node would: map_bag FILE.bag... [options]",
      options(), mapBag, "files");
}
