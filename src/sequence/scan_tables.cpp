#include "sequence/scan_tables.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>

#include "bki_mapping/core/named_parameter.h"
#include "core/counted.h"

namespace bki_mapping {
namespace {

/// Farthest that the stamp of a pose may be from the time of its scan [s]; files hold rounded times.
constexpr double kSameTime = 0.01;

[[noreturn]] void refuse(const std::string& text) {
  throw std::runtime_error(text);
}

std::string lineOf(const std::filesystem::path& file, std::size_t number) {
  return file.string() + " line " + std::to_string(number + 1);
}

[[noreturn]] void failWithoutLine(const std::filesystem::path& file, std::size_t number,
                                  const std::string& scan, std::size_t lines) {
  refuse(file.string() + " has no line " + std::to_string(number + 1) + " for scan " + scan + ", but " +
         std::to_string(lines) + " lines; line 1 belongs to scan 000000");
}

double checkedTime(double seconds, const std::filesystem::path& file, std::size_t number) {
  if (seconds >= 0.0 && seconds < 4e9) return seconds;
  refuse(lineOf(file, number) + ": the time must be from 0 to 4e9 s, as ROS stamps are");
}

Eigen::Isometry3d poseOf(const PoseLine& line) {
  if (!line.fault.empty()) refuse(line.fault);
  if (!line.rotation_fault.empty()) refuse(line.rotation_fault);
  return line.pose;
}

}  // namespace

ScanTimes::ScanTimes(const std::filesystem::path& file) : file_(file), given_(std::filesystem::exists(file)) {
  if (!given_) return;
  std::ifstream in(file, std::ios::binary);
  if (!in || std::filesystem::is_directory(file)) refuse(file.string() + " cannot be read; check its rights");
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    lines_.emplace_back(std::istream_iterator<std::string>(words), std::istream_iterator<std::string>());
  }
  while (!lines_.empty() && lines_.back().empty()) lines_.pop_back();
}

double ScanTimes::of(std::size_t number, const std::string& scan) const {
  if (!given_) return checkedTime(0.1 * static_cast<double>(number), file_, number);
  if (number >= lines_.size()) failWithoutLine(file_, number, scan, lines_.size());
  if (lines_[number].empty()) {
    refuse(lineOf(file_, number) + " is empty, but scan " + scan + " needs a time");
  }
  const std::string& word = lines_[number].front();
  char* end = nullptr;
  const double seconds = std::strtod(word.c_str(), &end);
  if (*end != '\0' || !std::isfinite(seconds)) {
    refuse(lineOf(file_, number) + ": '" + word + "' is not a finite number");
  }
  return checkedTime(seconds, file_, number);
}

ScanPoses::ScanPoses(const std::filesystem::path& file, bool timed)
    : path_(file), file_(readPoseFile(file.string(), "a sequence needs one pose for each scan")) {
  if (!file_.has_stamps || !timed) return;
  for (const PoseLine& line : file_.lines) {
    if (line.seconds) by_time_.emplace(*line.seconds, &line);
  }
}

Eigen::Isometry3d ScanPoses::first() const {
  if (file_.lines.empty()) failWithoutLine(path_, 0, sixDigits(0), 0);
  return poseOf(file_.lines.front());
}

Eigen::Isometry3d ScanPoses::of(std::size_t number, const std::string& scan, double seconds) const {
  if (!by_time_.empty()) return poseOf(at(seconds, scan));
  if (number >= file_.lines.size()) failWithoutLine(path_, number, scan, file_.lines.size());
  return poseOf(file_.lines[number]);
}

const PoseLine& ScanPoses::at(double seconds, const std::string& scan) const {
  auto nearest = by_time_.lower_bound(seconds);
  if (nearest == by_time_.end()) --nearest;
  if (nearest != by_time_.begin()) {
    const auto before = std::prev(nearest);
    if (seconds - before->first < std::abs(nearest->first - seconds)) nearest = before;
  }
  if (std::abs(nearest->first - seconds) <= kSameTime) return *nearest->second;
  refuse(path_.string() + " has no pose at " + numberText(seconds) + " s, the time of scan " + scan +
         " in times.txt; the nearest is at " + numberText(nearest->first) + " s, in line " +
         std::to_string(nearest->second->number));
}

}  // namespace bki_mapping
