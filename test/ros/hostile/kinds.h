/// @file What the hostile publisher sends: a table of kinds, each with the answers that a mapper may give.
#pragma once

#include <dynamic_reconfigure/Config.h>
#include <geometry_msgs/TransformStamped.h>
#include <sensor_msgs/PointCloud2.h>

#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <vector>

namespace bki_mapping::hostile {

/// Random numbers that are the same on every machine.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : random_(seed) {}
  std::uint64_t bits() { return random_(); }
  /// A number from 0 to n - 1.
  std::size_t below(std::size_t n) { return static_cast<std::size_t>(random_() % n); }
  bool oneIn(std::size_t n) { return below(n) == 0; }
  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(random_() >> 11) * 0x1p-53;
  }
  template <typename T>
  const T& oneOf(const std::vector<T>& values) {
    return values[below(values.size())];
  }

 private:
  std::mt19937_64 random_;
};

/// What may become of a cloud: "mapped", or a reason's name in dropKinds().
using Answers = std::vector<std::string>;

/// A cloud that is wrong, odd or merely unusual.
struct CloudKind {
  std::string name;
  std::string sent;  ///< in words
  Answers answers;
  /// Makes it from an honest cloud.
  std::function<void(sensor_msgs::PointCloud2&, Dice&)> change;
};
const std::vector<CloudKind>& cloudKinds();

/// Transforms, of which some frame is to carry an honest cloud afterwards.
struct TransformKind {
  struct Message {
    bool is_static;
    std::vector<geometry_msgs::TransformStamped> transforms;
  };
  std::string name;
  std::string sent;  ///< in words
  Answers answers;   ///< to an honest cloud in `frame` at `stamp`
  /// @param frame that nobody has heard of before. @param stamp of the cloud.
  std::function<std::vector<Message>(const std::string& frame, const ros::Time& stamp, Dice&)> make;
};
const std::vector<TransformKind>& transformKinds();

/// A path for ~save_map, odd or out of reach.
struct PathKind {
  std::string name;
  std::string sent;  ///< in words
  bool written;      ///< whether a map is written there
  /// @param folder that may be written to.
  std::function<std::string(const std::string& folder)> make;
};
const std::vector<PathKind>& pathKinds();

/// Changes to the settings of a mapper, some of them not allowed.
struct SettingsKind {
  std::string name;
  std::string sent;  ///< in words
  std::function<void(dynamic_reconfigure::Config&, Dice&)> change;
};
const std::vector<SettingsKind>& settingsKinds();

/// An honest cloud of class table `toy` with the fields that every set of settings reads: x, y, z, label,
/// rgb, scores (one a class), labels and label_scores (the likeliest three), ns and seconds (times).
sensor_msgs::PointCloud2 honestCloud(const std::string& frame, const ros::Time& stamp, Dice& dice);

/// A transform from `frame` to `parent`.
geometry_msgs::TransformStamped honestTransform(const std::string& parent, const std::string& frame,
                                                const ros::Time& stamp, double x = 0.0);

/// Turns the bytes of each number of the cloud around, and says so in is_bigendian.
void swapBytes(sensor_msgs::PointCloud2& cloud);

/// Gives packed colours an alpha.
void setAlpha(sensor_msgs::PointCloud2& cloud, Dice& dice);

/// Everything else that is done to a mapper; hostile_test does it.
struct DeedKind {
  std::string name;
  std::string sent;  ///< in words
};
const std::vector<DeedKind>& deedKinds();

}  // namespace bki_mapping::hostile
