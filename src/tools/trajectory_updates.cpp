#include "tools/trajectory_updates.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "core/counted.h"
#include "core/stopwatch.h"
#include "tools/run_report.h"
#include "tools/sequence_options.h"

namespace bki_mapping::tools {

void addTrajectoryUpdates(po::options_description& options) {
  options.add_options()(
      "trajectory-updates", textOption("FILE"),
      "file with one correction per line: the number of a scan, and a file of poses; the scans up to that "
      "one then move there")(
      "correction-tolerance",
      realOption("--correction-tolerance", 0.0)->value_name("METRES")->default_value(0.0),
      "scans stay while no point is farther than this from where an update puts it");
}

std::unique_ptr<JournalledMapping> JournalledMapping::begin(const po::variables_map& given,
                                                            SemanticMapper& mapper) {
  const bool updates = given.count("trajectory-updates") > 0;
  if (!updates && !given["correction-tolerance"].defaulted()) {
    throw std::invalid_argument("--correction-tolerance needs --trajectory-updates");
  }
  if (updates && given.count("poses") == 0) {
    throw std::invalid_argument(
        "--trajectory-updates has poses in the frame of the map; give the first poses in it, too, with "
        "--poses");
  }
  if (!updates && given.count("journal") == 0) return nullptr;
  MapCorrector::Settings settings;
  if (given.count("journal")) settings.quantum = given["journal"].as<double>();
  settings.tolerance = given["correction-tolerance"].as<double>();
  std::unique_ptr<JournalledMapping> mapping(new JournalledMapping(mapper, settings));
  mapping->kept_.noteForeign(mapper.map().regions());  // of the map that is continued
  if (updates) {
    mapping->readUpdates(given["trajectory-updates"].as<std::string>());
    mapping->poses_ = sequenceOptionsOf(given);
  }
  return mapping;
}

void JournalledMapping::readUpdates(const std::string& path) {
  std::ifstream in(path);
  if (!in) throw std::runtime_error("cannot read " + path + "; check the path of --trajectory-updates");
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    if (line.empty() || line.front() == '#') continue;
    std::istringstream words(line);
    Update update;
    if (!(words >> update.scan >> std::ws) || !std::getline(words, update.poses) || update.poses.empty()) {
      throw std::runtime_error(
          path + ", line " + std::to_string(number) +
          ": must be the number of a scan and a file of poses, such as '120 poses_120.txt'");
    }
    if (!updates_.empty() && update.scan < updates_.back().scan) {
      throw std::runtime_error(path + ", line " + std::to_string(number) + ": scan " +
                               std::to_string(update.scan) +
                               " comes after a later one; sort the lines by scan");
    }
    update.poses = (std::filesystem::path(path).parent_path() / update.poses).string();
    if (!std::ifstream(update.poses)) {
      throw std::runtime_error(path + ", line " + std::to_string(number) + ": cannot read " + update.poses +
                               "; paths are relative to the list");
    }
    updates_.push_back(std::move(update));
  }
}

ScanStats JournalledMapping::integrate(const Sequence& sequence, std::size_t i, const SequenceFrame& frame) {
  const ScanStats stats = kept_.integrateRecorded(frame.recordedScan(), frame.T_map_sensor);
  mapped_.push_back(i);
  for (; next_ < updates_.size() && updates_[next_].scan <= sequence.number(i); ++next_) {
    poses_.map_poses = updates_[next_].poses;
    const Sequence corrected(sequence.folder(), poses_);
    std::vector<StampedMotion> keyframes;
    for (const std::size_t n : mapped_) keyframes.push_back({sequence.stamp(n), corrected.pose(n)});
    kept_.corrector().correct(keyframes, {Eigen::Isometry3d::Identity()});
  }
  kept_.update();
  return stats;
}

void JournalledMapping::finish() {
  Stopwatch watch;
  kept_.finish();
  waited_ms_ = watch.lap();
}

std::string JournalledMapping::summary() const {
  const MapCorrector::Progress progress = kept_.corrector().progress();
  std::ostringstream text;
  text << summaryText(kept_);
  if (progress.paths == 0) return text.str();
  text << counted(progress.paths, "correction") << " made " << counted(progress.moved, "move")
       << " of scans; the last took " << std::round(waited_ms_) << " ms after the last scan\n";
  if (next_ < updates_.size()) {
    text << counted(updates_.size() - next_, "update") << " of later scans had no effect\n";
  }
  if (progress.failed > 0) {
    text << counted(progress.failed, "scan") << " could not be moved: " << progress.fault << "\n";
  }
  return text.str();
}

}  // namespace bki_mapping::tools
