/// @file The sets of settings under which the hostile publisher attacks the mapper.
#pragma once

#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace bki_mapping::hostile {

/// Parameters of the mapper by name, in addition to those that all sets share (Mapper::load).
struct Settings {
  std::string name;
  std::map<std::string, std::string> values;
};

/// @param text of the parameters: NAME=VALUE, with blanks between them.
inline Settings settingsOf(const std::string& name, const std::string& text) {
  Settings settings{name, {}};
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    const std::size_t equals = word.find('=');
    settings.values[word.substr(0, equals)] = word.substr(equals + 1);
  }
  return settings;
}

inline const std::vector<Settings>& allSettings() {
  static const std::vector<Settings> all = {
      settingsOf("robot", "rules/enabled=true sensor_model/max_range=60"),
      settingsOf("corrected",
                 "rules/enabled=true sensor_model/max_range=60 window=0 journal=true journal_limit=1 "
                 "correction/tolerance=0"),
      settingsOf("window_below_a_block", "window=0.5 sensor_model/max_range=20"),
      settingsOf("defaults", "window=0"),
      settingsOf("coarse", "resolution=5 downsample_resolution=1 free_space/mode=linear window=400"),
      settingsOf("fine",
                 "resolution=0.02 downsample_resolution=0.01 window=2 free_space/mode=even "
                 "free_space/gap=0.2 sensor_model/max_range=3"),
      settingsOf("counting",
                 "kernel/type=counting occlusion=all downsample_resolution=0 sensor_model/max_range=15"),
      settingsOf("colours",
                 "label_encoding=rgb label_field=rgb color_match=nearest free_space/mode=none "
                 "occlusion=mapped sensor_model/max_range=30"),
      settingsOf("scores",
                 "label_encoding=scores label_field= score_fields=scores free_space/mode=uniform "
                 "free_space/samples_per_beam=3 sensor_model/max_range=30"),
      settingsOf("top_k",
                 "label_encoding=top_k label_field=labels score_fields=label_scores score_type=logit "
                 "free_space/extent=mapped sensor_model/max_range=60"),
      settingsOf("moving_sensor",
                 "sensor_frame_id=honest_base time_field=seconds free_space/beam_index=rtree "
                 "unknown_labels=unlabelled on_time_jump=reset sensor_model/max_range=30"),
      settingsOf("no_returns",
                 "clear_no_returns=true time_field=ns unlabelled_points=ignore queue_policy=drop_newest "
                 "memory_limit=2 free_space/weight=uniform sensor_model/max_range=10"),
      settingsOf("two_lidars",
                 "inputs/front/topic=/hostile_cloud inputs/front/time_field=seconds "
                 "inputs/front/clear_no_returns=true inputs/front/max_range=12 "
                 "inputs/rear/topic=/hostile_cloud_2 inputs/rear/label_encoding=bgr "
                 "inputs/rear/label_field=rgb inputs/rear/sensor_frame_id=honest_base "
                 "inputs/rear/min_range=1 inputs/rear/max_range=40 window=30"),
  };
  return all;
}

}  // namespace bki_mapping::hostile
