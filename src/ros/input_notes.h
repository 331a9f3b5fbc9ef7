/// @file What the node says of an input, once while the settings stay.
#pragma once

#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/mapping/mapper_config.h"
#include "bki_mapping/mapping/scan_stats.h"
#include "ros/scan_reader.h"
#include "settings/label_watch.h"

namespace bki_mapping::ros_interface {

/// What there is to say of an input.
struct InputSentences {
  std::vector<std::string> warnings, notes;
};

/// Each function returns a sentence for the log, or "" if there is nothing to say, or nothing new.
class InputNotes {
 public:
  /// @param topic of the input's clouds.
  explicit InputNotes(std::string topic) : topic_(std::move(topic)) {}

  /// Says everything again, as is right when settings have changed.
  void restart() { *this = InputNotes(topic_); }

  /// The settings take clouds without labels, but the class table has several classes.
  std::string ofSettings(const InputConfig& input, const ClassTable& classes) const;
  /// All of the following, after one of the input's clouds was mapped.
  InputSentences ofScan(const sensor_msgs::PointCloud2& cloud, const PlacedScan& placed,
                        const PointCounts& counts, const ScanReader& reader, const ClassTable& classes,
                        const MapperConfig& config);
  /// The beams of clouds in the map frame start at its origin. @param doubtful see ScanReader.
  std::string ofOrigin(bool doubtful, const std::string& map_frame);
  /// Points are left out because the maximum range of the sensor is not known. @param count of one cloud.
  std::string ofFarPoints(std::size_t count, const InputConfig& input);
  /// Labels that the class table does not list, of each once.
  std::string ofLabels(const PlacedScan& placed, const PointCounts& counts, const InputConfig& input,
                       const ClassTable& classes, const MapperConfig& config);
  /// What to do about the labels that were named last; "" at first.
  const std::string& labelRemedy() const { return labels_.remedy(); }
  /// How the times of points are read. @param reading as TimeReading::text; may be "".
  std::string ofTimes(const std::string& reading);
  /// Why beams without a return clear nothing. @param count of such beams in one cloud.
  std::string ofNoDirection(NoDirection reason, std::size_t count);

 private:
  std::string topic_;
  bool said_of_origin_ = false, said_of_far_points_ = false;
  LabelWatch labels_;
  std::set<std::string> times_;
  std::set<NoDirection> no_directions_;
};

}  // namespace bki_mapping::ros_interface
