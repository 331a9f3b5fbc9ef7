/// @file Adds up how the points of integrated clouds were used, as ScanPreprocessor counts them, and assesses
/// whether that is healthy.
#pragma once

#include <bki_mapping/MappingStatus.h>

#include <string>
#include <vector>

#include "core/unlisted_labels.h"
#include "mapping/scan_preprocessor.h"
#include "ros/input_config.h"

namespace bki_mapping::ros_interface {

/// The health reported on /diagnostics: a level of diagnostic_msgs/DiagnosticStatus, and its message.
struct Health {
  std::uint8_t level = 0;
  std::string message;
};

/// A reason for which points are left out, and its counters.
struct PointKind {
  const char* name;
  std::size_t PointCounts::*in_scan;
  std::uint64_t MappingStatus::*in_status;
  /// Whether many such points are normal for a healthy sensor with suitable settings: beams without a return,
  /// points out of range, unlabelled points.
  bool may_be_many;
};
/// All reasons for which points are left out.
const std::vector<PointKind>& pointKinds();

/// The points of an input since the last report.
struct PointAccount {
  std::size_t clouds = 0;
  PointCounts counts;
  UnlistedLabels unlisted_labels;
  std::string label_remedy;  ///< of LabelWatch, for unlisted_labels

  void add(const PointCounts& of_scan, const UnlistedLabels& labels);
};

/// Assesses whether integrated clouds contribute to the map.
/// - Of the points that are used, or left out for their label, at least 10 % are left out: WARN.
/// - Of the points that are used, or left out for a fault (label, min_range, outside of the map), less than
/// 10 % are
///   used: WARN; less than 0.1 %: ERROR. Applies if these are at least 1 % of all points.
/// - Less than 0.1 % of all points are used or beams without a return: WARN.
/// @param topic of the input. @param mapper settings common to all inputs. @param classes name of the class
/// table.
/// @return a sentence with the most frequent reason, and the remedy; OK without a message if all is well.
Health judgePoints(const PointAccount& account, const std::string& topic, const InputConfig& input,
                   const MapperConfig& mapper, const std::string& classes);

}  // namespace bki_mapping::ros_interface
