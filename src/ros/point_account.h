/// @file What became of the points of integrated clouds, and whether that is healthy.
#pragma once

#include <bki_mapping/MappingStatus.h>

#include <map>
#include <string>
#include <vector>

#include "mapping/scan_preprocessor.h"
#include "ros/health.h"
#include "ros/input_config.h"

namespace bki_mapping::ros_shell {

/// Why a point is no hit, and its counters.
struct PointKind {
  const char* name;
  std::size_t PointCounts::*in_scan;
  std::uint64_t MappingStatus::*in_status;
  /// Whether healthy sensors, with settings that suit them, can have many: beams without a return, points out
  /// of range or of no interest.
  bool may_be_many;
};
/// All kinds of points that are neither used nor beams without a return.
const std::vector<PointKind>& pointKinds();

/// The points of an input since the last report.
struct PointAccount {
  std::size_t clouds = 0;
  PointCounts counts;
  std::map<std::uint32_t, std::size_t> unknown_labels;

  void add(const PointCounts& of_scan, const std::map<std::uint32_t, std::size_t>& labels);
};

/// Judges whether clouds that are integrated have anything to say.
/// - Of the points used or left out for a fault (label, min_range, too far for the map) less than 10 % are
///   used: WARN; less than 0.1 %: ERROR. They must be 1 % of all points to be judged.
/// - Less than 0.1 % of all points are used or beams without a return, whatever the reason: WARN.
/// @param topic of the input. @param mapper the settings of all inputs. @param classes name of the table.
/// @return a sentence that names the reason with the most points, and the remedy.
Health judgePoints(const PointAccount& account, const std::string& topic, const InputConfig& input,
                   const MapperConfig& mapper, const std::string& classes);

}  // namespace bki_mapping::ros_shell
