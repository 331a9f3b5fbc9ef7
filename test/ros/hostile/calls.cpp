#include <sys/stat.h>

#include <filesystem>
#include <stdexcept>

#include "free_space/free_space_model.h"
#include "kinds.h"

namespace bki_mapping::hostile {
namespace {

using dynamic_reconfigure::Config;

void set(Config& config, const std::string& name, double value) {
  config.doubles.emplace_back();
  config.doubles.back().name = name;
  config.doubles.back().value = value;
}
void set(Config& config, const std::string& name, int value) {
  config.ints.emplace_back();
  config.ints.back().name = name;
  config.ints.back().value = value;
}
void set(Config& config, const std::string& name, bool value) {
  config.bools.emplace_back();
  config.bools.back().name = name;
  config.bools.back().value = value;
}
void set(Config& config, const std::string& name, const std::string& value) {
  config.strs.emplace_back();
  config.strs.back().name = name;
  config.strs.back().value = value;
}

const std::vector<std::string> kNumbers = {"free_space_gap",
                                           "rules_void_outweighs",
                                           "rules_stands_after",
                                           "rules_living_stands_after",
                                           "rules_together",
                                           "sensor_model_height",
                                           "tf_timeout",
                                           "memory_limit",
                                           "sensor_model_min_range",
                                           "sensor_model_max_range",
                                           "window",
                                           "publish_rate",
                                           "view_range",
                                           "view_min_z",
                                           "view_max_z",
                                           "occupancy_min_z",
                                           "occupancy_max_z",
                                           "distance_section_height",
                                           "distance_section_range",
                                           "distance_section_max_distance"};
const std::vector<std::string> kWords = {"free_space_mode", "free_space_weight", "free_space_extent",
                                         "occlusion",       "unlabelled_points", "queue_policy",
                                         "on_time_jump",    "color_mode"};

void setAllowed(Config& config, Dice& dice) {
  using Words = std::vector<std::string>;
  const auto sometimes = [&] { return dice.oneIn(3); };
  if (sometimes()) set(config, "free_space_mode", dice.oneOf<std::string>(freeSpaceModes()));
  if (sometimes()) set(config, "free_space_gap", dice.between(0.3, 3.0));
  if (sometimes()) set(config, "free_space_samples_per_beam", static_cast<int>(1 + dice.below(4)));
  if (sometimes())
    set(config, "free_space_weight", dice.oneOf<std::string>(Words{"uniform", "linear", "bilinear"}));
  if (sometimes()) set(config, "free_space_extent", dice.oneOf<std::string>(Words{"mapped", "observed"}));
  if (sometimes()) set(config, "clear_beyond_max_range", dice.oneIn(2));
  for (const char* name : {"rules_void_outweighs", "rules_stands_after", "rules_living_stands_after"}) {
    if (sometimes()) set(config, name, dice.oneIn(4) ? 0.0 : dice.between(0.5, 100.0));
  }
  if (sometimes()) set(config, "rules_together", dice.oneIn(4) ? 0.0 : dice.between(0.1, 3.0));
  if (sometimes()) set(config, "sensor_model_height", dice.oneIn(4) ? 0.0 : dice.between(0.1, 3.0));
  if (sometimes()) set(config, "sensor_model_min_range", dice.between(0.0, 2.0));
  if (sometimes()) set(config, "sensor_model_max_range", dice.between(0.1, 40.0));
  if (sometimes()) set(config, "occlusion", dice.oneOf<std::string>(Words{"none", "mapped", "all"}));
  if (sometimes()) set(config, "unlabelled_points", dice.oneOf<std::string>(Words{"occupied", "ignore"}));
  if (sometimes()) set(config, "queue_size", static_cast<int>(1 + dice.below(20)));
  if (sometimes()) set(config, "queue_policy", dice.oneOf<std::string>(Words{"drop_oldest", "drop_newest"}));
  if (sometimes()) set(config, "on_time_jump", dice.oneOf<std::string>(Words{"keep", "reset"}));
  if (sometimes()) set(config, "window", dice.oneOf<double>({0.1, 1.0, 10.0, 40.0}));
  if (sometimes()) set(config, "publish_rate", dice.between(0.5, 100.0));
  if (sometimes()) set(config, "view_range", dice.between(0.0, 30.0));
  if (sometimes())
    set(config, "color_mode",
        dice.oneOf<std::string>(Words{"semantics", "probability", "variance", "height"}));
  if (sometimes()) set(config, "occupancy_max_z", dice.between(-5.0, 5.0));
  if (sometimes()) set(config, "distance_section_height", dice.between(-3.0, 3.0));
  if (sometimes()) set(config, "distance_section_range", dice.between(0.1, 100.0));
  if (sometimes()) set(config, "distance_section_max_distance", dice.between(0.1, 20.0));
  if (sometimes()) set(config, "distance_section_unknown", dice.oneIn(2));
}

/// Creates something other than a regular file: a pipe, because devices need rights that tests may lack.
std::string nodeIn(const std::string& folder) {
  std::string path = folder + "/full.ply";
  constexpr mode_t kRights = 0600;
  if (!std::filesystem::exists(path) && mknod(path.c_str(), S_IFCHR | kRights, (1 << 8) | 7) != 0 &&
      mkfifo(path.c_str(), kRights) != 0) {
    throw std::runtime_error(path + " cannot be made");
  }
  return path;
}

std::string folderIn(const std::string& folder) {
  std::string path = folder + "/folder.ply";
  std::filesystem::create_directories(path);
  return path;
}

}  // namespace

const std::vector<PathKind>& pathKinds() {
  using Text = const std::string&;
  static const std::vector<PathKind> kinds = {
      {"path/ply", "a file", true, [](Text folder) { return folder + "/map.ply"; }},
      {"path/pcd", "a file", true, [](Text folder) { return folder + "/map.pcd"; }},
      {"path/not_utf8", "a file's name that is not UTF-8", true,
       [](Text folder) { return folder + "/\xff\n%s.ply"; }},
      {"path/empty", "no path", false, [](Text) { return std::string(); }},
      {"path/relative", "a relative path", false, [](Text) { return std::string("map.ply"); }},
      {"path/ending", "an unknown ending", false, [](Text folder) { return folder + "/map.txt"; }},
      {"path/folder", "a folder", false, folderIn},
      {"path/no_folder", "a folder that does not exist", false,
       [](Text folder) { return folder + "/none/map.ply"; }},
      {"path/in_a_file", "a file as folder", false, [](Text folder) { return folder + "/map.ply/map.ply"; }},
      {"path/long", "a name of 5000 letters", false,
       [](Text folder) { return folder + "/" + std::string(5000, 'm') + ".ply"; }},
      {"path/zero", "a path with a zero byte", false,
       [](Text folder) { return folder + std::string("/map\0.ply", 9); }},
      {"path/device", "a device, or a pipe", false, nodeIn},
  };
  return kinds;
}

const std::vector<SettingsKind>& settingsKinds() {
  static const std::vector<SettingsKind> kinds = {
      {"settings/allowed", "other modes, ranges, gains, windows and queues", setAllowed, false},
      {"settings/nan", "NaN",
       [](Config& config, Dice& dice) {
         for (int n = 0; n < 3; ++n) set(config, dice.oneOf(kNumbers), kNan);
       }},
      {"settings/infinite", "infinite numbers",
       [](Config& config, Dice& dice) {
         for (int n = 0; n < 3; ++n) set(config, dice.oneOf(kNumbers), dice.oneIn(2) ? kInf : -kInf);
       }},
      {"settings/extreme", "numbers of 1e300, -1e300 and 0",
       [](Config& config, Dice& dice) {
         for (int n = 0; n < 3; ++n)
           set(config, dice.oneOf(kNumbers), dice.oneOf<double>({1e300, -1e300, 0.0, -0.0}));
         set(config, "queue_size", dice.oneOf<int>({0, -1, 2147483647, -2147483647 - 1}));
       }},
      {"settings/outside", "one number just beyond its limits, which clients show",
       [](Config& config, Dice& dice) {
         const auto [name, value] =
             dice.oneOf<std::pair<std::string, double>>({{"rules_stands_after", -1.0},
                                                         {"rules_void_outweighs", -1e-9},
                                                         {"sensor_model_min_range", -0.1},
                                                         {"rules_together", 11.0},
                                                         {"publish_rate", 0.0}});
         set(config, name, value);
       }},
      {"settings/word", "words that are not among the choices",
       [](Config& config, Dice& dice) {
         set(config, dice.oneOf(kWords),
             dice.oneOf<std::string>({"", "liner", std::string(100000, 'w'), std::string("\xff\0%s", 4)}));
       }},
      {"settings/unknown", "names of unknown settings",
       [](Config& config, Dice&) {
         set(config, "resolutoin", 0.1);
         set(config, std::string(10000, 'n'), true);
         set(config, "\xff", 1);
       }},
      {"settings/type", "a number as text, a word as number",
       [](Config& config, Dice& dice) {
         set(config, dice.oneOf(kNumbers), std::string("ten"));
         set(config, dice.oneOf(kWords), 3.0);
         set(config, "queue_size", true);
       }},
      {"settings/fixed", "another resolution, map frame or class table",
       [](Config& config, Dice& dice) {
         if (dice.oneIn(2)) set(config, "resolution", dice.oneOf<double>({0.001, 50.0, kNan}));
         if (dice.oneIn(2)) set(config, "frame_id", std::string("nowhere"));
         set(config, "classes", dice.oneOf<std::string>({"nuscenes", "", "/dev/zero", "/", "none"}));
       }},
      {"settings/twice", "a setting twenty times in one message",
       [](Config& config, Dice& dice) {
         for (int n = 0; n < 20; ++n) set(config, "window", dice.between(1.0, 30.0));
       }},
  };
  return kinds;
}

const std::vector<DeedKind>& deedKinds() {
  static const std::vector<DeedKind> kinds = {
      {"deed/two_wrongs", "a cloud with two of the kinds above at once"},
      {"deed/burst", "30 clouds of all kinds, without waiting for an answer"},
      {"deed/transform_after", "a cloud whose transform comes after it"},
      {"deed/time_back", "three clouds, and three that are up to 100 s older"},
      {"deed/pause", "`~pause`, a cloud, `~resume`"},
      {"deed/reset", "`~reset`"},
      {"deed/publish_map", "`~publish_map`"},
      {"deed/include", "`~save_map` with states that are unknown, or a million of them"},
      {"deed/clear_box", "`~clear_bbx` with corners that are swapped, far away, infinite or NaN"},
      {"deed/listeners", "subscribers of all topics that come and go"},
      {"deed/reload", "unloading under traffic, and loading again"},
  };
  return kinds;
}

}  // namespace bki_mapping::hostile
