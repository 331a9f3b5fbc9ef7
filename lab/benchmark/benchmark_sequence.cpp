// Times the integration of a sequence in every mode, against pcl::VoxelGrid on the same scans in the same
// run.
#include <cstdio>
#include <optional>

#include "bki_mapping/mapping/mapper_config.h"
#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/settings/yaml.h"
#include "core/atomic_file.h"
#include "core/quantile.h"
#include "core/stopwatch.h"
#include "curves.h"
#include "journal/kept_scans.h"
#include "journal/scan_codec.h"
#include "tools/run_report.h"
#include "tools/sequence_options.h"
#include "tools/yardstick.h"

namespace {

using namespace bki_mapping;
namespace po = tools::po;
using benchmark::Case;

/// Times of the scans in all repeats [ms].
struct Timing {
  std::vector<double> yardstick, integration;
  std::vector<double> journal_ratios;  ///< of each scan, the time with a journal to that without
  std::size_t map_bytes = 0;

  double median() const { return quantile(integration, 0.5); }
  double ratio() const { return median() / quantile(yardstick, 0.5); }
  /// As text; "" without a journal.
  std::string journalRatio() const {
    if (journal_ratios.empty()) return "";
    char text[32];
    std::snprintf(text, sizeof text, "%.3f", quantile(journal_ratios, 0.5));
    return text;
  }
};

/// A preset with other settings on top of its own. @param name of the preset, by which the tables call it.
Case presetCase(const std::string& name, const std::map<std::string, std::string>& changes) {
  Case preset = {name, loadParameterFile(name)};
  for (const auto& [parameter, value] : changes) preset.settings[parameter] = value;
  return preset;
}

/// The modes with default settings, and what robots run.
std::vector<Case> cases() {
  std::vector<Case> all = benchmark::modeCases();
  all.push_back({"line, bilinear, mapped", {{"free_space/extent", "mapped"}, {"resolution", "0.1"}}});
  all.push_back(presetCase("robot", {}));
  all.push_back(presetCase("robot", {{"resolution", "0.1"}}));
  // The paper's kernel reaches three of these voxels to each side: it takes the loops of wide kernels.
  all.push_back(presetCase("paper_line", {{"resolution", "0.1"}, {"kernel/length", "0.3"}}));
  return all;
}

po::options_description options() {
  po::options_description options("Options");
  options.add(tools::sequenceOptions());
  options.add_options()("csv", po::value<std::string>()->value_name("FILE"), "output table")(
      "warm-up", tools::countOption("--warm-up", 0)->value_name("N")->default_value(3),
      "number of first scans that are not timed")(
      "repeats", tools::countOption("--repeats", 1)->value_name("N")->default_value(5),
      "number of times that each mode maps the sequence")(
      "journal", tools::realOption("--journal", 1e-4, 1.0)->value_name("METRES"),
      "also map with the scans kept and their points rounded to this, and print how many times as long that "
      "takes; modes whose scans cannot move are left out")(
      "curves", po::value<std::string>()->value_name("DIR"),
      "also measure simulated drives, and write curves as CSV and PNG to this folder")(
      "curve-scans", tools::countOption("--curve-scans", 2, 1000000)->value_name("N")->default_value(2000),
      "scans of the drive during which the map grows");
  return options;
}

void timeYardstick(const std::vector<SequenceFrame>& frames, std::size_t warm_up, Timing& timing) {
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const double ms = tools::yardstick(frames[i]).wall;
    if (i >= warm_up) timing.yardstick.push_back(ms);
  }
}

MapperConfig configOf(const Case& c, int threads) {
  MapperConfig config;
  setParameters(config, c.settings);
  config.threads = threads;
  return config;
}

/// The time of each scan [ms]. @param after called after each, and not timed.
template <typename After>
std::vector<double> timeScans(SemanticMapper& mapper, const std::vector<SequenceFrame>& frames,
                              After&& after) {
  std::vector<double> times;
  for (const SequenceFrame& frame : frames) {
    const Scan scan = frame.scan();
    Stopwatch watch;
    mapper.integrate(scan);
    times.push_back(watch.lap());
    after(frame);
  }
  return times;
}

/// The same with a journal. Each scan is packed before the next one comes, as at 10 Hz; that is not timed.
/// @param quantum [m].
std::vector<double> timeKeptScans(SemanticMapper& mapper, const std::vector<SequenceFrame>& frames,
                                  double quantum) {
  MapCorrector::Settings settings;
  settings.quantum = quantum;
  KeptScans kept(mapper, settings);
  std::vector<double> times;
  for (const SequenceFrame& frame : frames) {
    const Scan scan = frame.recordedScan();
    Stopwatch watch;
    kept.update();
    kept.integrateRecorded(scan, frame.T_map_sensor);
    times.push_back(watch.lap());
    kept.finish();
  }
  return times;
}

bool canBeKept(const MapperConfig& config) {
  try {
    MapCorrector::checkCorrectable(config);
  } catch (const std::invalid_argument&) {
    return false;
  }
  return true;
}

void timeCase(const Case& c, int threads, const std::vector<SequenceFrame>& frames, std::size_t warm_up,
              const std::shared_ptr<const ClassTable>& classes, Timing& timing) {
  SemanticMapper mapper(configOf(c, threads), classes);
  const std::vector<double> times = timeScans(mapper, frames, [](const SequenceFrame&) {});
  timing.integration.insert(timing.integration.end(), times.begin() + static_cast<std::ptrdiff_t>(warm_up),
                            times.end());
  timing.map_bytes = mapper.map().bytes();
}

/// @param quantum of the journal [m].
void timeJournal(const Case& c, int threads, const std::vector<SequenceFrame>& frames, std::size_t warm_up,
                 const std::shared_ptr<const ClassTable>& classes, double quantum, Timing& timing) {
  const MapperConfig config = configOf(c, threads);
  if (!canBeKept(config)) return;
  const auto timed = [&](auto&& time) {
    SemanticMapper mapper(config, classes);
    return time(mapper);
  };
  // Packing empties the caches for the next scan, so it runs in both.
  const std::vector<double> without = timed([&](SemanticMapper& mapper) {
    return timeScans(mapper, frames, [&](const SequenceFrame& frame) {
      packScan(toSensorScan(frame.recordedScan(), Eigen::Isometry3d::Identity(), quantum, config.sensor_model)
                   .scan);
    });
  });
  const std::vector<double> with =
      timed([&](SemanticMapper& mapper) { return timeKeptScans(mapper, frames, quantum); });
  for (std::size_t i = warm_up; i < frames.size(); ++i) timing.journal_ratios.push_back(with[i] / without[i]);
}

int measure(const po::variables_map& given) {
  const Sequence sequence = tools::openSequence(given);
  const auto [first, last] = tools::frameRange(given, sequence);
  const std::size_t warm_up = tools::count(given, "warm-up");
  const std::size_t repeats = tools::count(given, "repeats");
  if (last - first <= warm_up)
    throw std::invalid_argument("no scans are left after --warm-up; lower it, or raise --scans");
  if (given.count("csv")) checkWritable(given["csv"].as<std::string>());
  std::vector<SequenceFrame> frames;
  for (std::size_t i = first; i < last; ++i) frames.push_back(sequence.read(i));
  const auto classes = std::make_shared<const ClassTable>(loadClassTable("semantic_kitti"));
  std::optional<double> quantum;
  if (given.count("journal")) quantum = given["journal"].as<double>();

  std::string csv = "mode,resolution,threads,median_ms,p99_ms,ratio_to_y,map_bytes,journal_ratio\n";
  std::printf("%-26s %10s %7s %9s %9s %8s %8s %8s %8s\n", "mode", "resolution", "threads", "median ms",
              "p99 ms", "ratio", "map MB", "speed-up", "journal");
  for (const Case& c : cases()) {
    const auto set = c.settings.find("resolution");
    const std::string edge = set == c.settings.end() ? numberText(MapperConfig().resolution) : set->second;
    Timing timings[2];  // with one thread, and with two
    for (std::size_t repeat = 0; repeat < repeats; ++repeat) {
      for (int threads = 1; threads <= 2; ++threads) {
        // Measured in every repeat, so that both terms of a ratio see the same load of the machine.
        timeYardstick(frames, warm_up, timings[threads - 1]);
        timeCase(c, threads, frames, warm_up, classes, timings[threads - 1]);
        if (quantum) timeJournal(c, threads, frames, warm_up, classes, *quantum, timings[threads - 1]);
      }
    }
    for (int threads = 1; threads <= 2; ++threads) {
      const Timing& t = timings[threads - 1];
      const double p99_ms = quantile(t.integration, 0.99);
      std::printf("%-26s %10s %7d %9.1f %9.1f %8.2f %8.1f %8.2f %8s\n", c.name.c_str(), edge.c_str(), threads,
                  t.median(), p99_ms, t.ratio(), static_cast<double>(t.map_bytes) / 1e6,
                  timings[0].median() / t.median(), t.journalRatio().c_str());
      csv += '"' + c.name + "\"," + edge + "," + std::to_string(threads) + "," + std::to_string(t.median()) +
             "," + std::to_string(p99_ms) + "," + std::to_string(t.ratio()) + "," +
             std::to_string(t.map_bytes) + "," + t.journalRatio() + "\n";
    }
    std::fflush(stdout);
  }
  std::printf("peak memory of the whole run: %.0f MB\n",
              static_cast<double>(tools::peakResidentBytes()) / 1e6);
  if (given.count("csv")) writeTextFile(given["csv"].as<std::string>(), csv);
  if (given.count("curves")) {
    benchmark::measureCurves(given["curves"].as<std::string>(), tools::count(given, "curve-scans"));
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return tools::run(argc, argv, "benchmark_sequence",
                    "Times every mode on a sequence, in ratios to pcl::VoxelGrid at 0.1 m in the same run.",
                    options(), measure);
}
