#include "ros/correction_config.h"

#include "ros/frame_parameter.h"

namespace bki_mapping::ros_interface {

std::vector<NamedParameter<CorrectionConfig>> correctionParameters() {
  using C = CorrectionConfig;
  return {
      truthParameter("journal", &C::journal, Changes::kAtStart,
                     "Keep all scans, so that the map follows corrected_path. Set true where a SLAM system "
                     "corrects the poses of the past. With window it needs map_file, whose journal then "
                     "keeps them."),
      realParameter(
          "journal_quantum", &C::journal_quantum, NumberRange::atLeast(0.0001).upTo(1.0), "m",
          Changes::kAtStart,
          "Points of kept scans are rounded to multiples of this in the sensor's frame, before they "
          "are mapped. Raise it to save memory; with a resolution below 0.2 m, lower it to a hundredth of "
          "resolution."),
      realParameter(
          "journal_limit", &C::journal_limit, NumberRange::atLeast(0.0), "MB", Changes::kAtStart,
          "Largest memory of kept scans. Beyond it the oldest ones are read from map_file when they "
          "move; without map_file they are forgotten, and stay in the map where they are. 0 sets no "
          "limit."),
      realParameter("correction/tolerance", &C::tolerance, NumberRange::atLeast(0.0).orElse(-1.0), "m",
                    Changes::kAtStart,
                    "Scans stay where they are while no point is farther than this from where corrected_path "
                    "puts it. -1 stands for a tenth of resolution; 0 moves all."),
      frameParameter("corrected_frame_id", &C::corrected_frame_id, "a frame of tf, or empty",
                     Changes::kAtStart,
                     "Frame of the robot whose poses corrected_path has, for example base_link; it must not "
                     "move relative to the sensor. Empty: the sensor's frame."),
      frameParameter("odometry_frame_id", &C::odometry_frame_id, "a frame of tf, or empty", Changes::kAtStart,
                     "Frame in which the poses of the robot never jump, for example odom. Scans between two "
                     "poses of corrected_path keep the shape of their way in it. Empty: frame_id, in which "
                     "scans beside a jump of tf are then a little off."),
  };
}

}  // namespace bki_mapping::ros_interface
