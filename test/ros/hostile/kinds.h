/// @file The messages of the hostile publisher: a table of kinds, each with the permitted answers of the
/// mapper.
#pragma once

#include <dynamic_reconfigure/Config.h>
#include <geometry_msgs/TransformStamped.h>
#include <nav_msgs/Path.h>
#include <sensor_msgs/PointCloud2.h>

#include <cstdint>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <vector>

namespace bki_mapping::hostile {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

/// Random numbers that are equal on every machine.
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

/// The permitted outcomes of a cloud: "mapped", or the name of a reason in dropKinds().
using Answers = std::vector<std::string>;

/// A cloud that is faulty or unusual.
struct CloudKind {
  std::string name;
  std::string sent;  ///< description
  Answers answers;
  /// Changes a valid cloud.
  std::function<void(sensor_msgs::PointCloud2&, Dice&)> change;
};
const std::vector<CloudKind>& cloudKinds();

/// Transforms, followed by a valid cloud in one of their frames.
struct TransformKind {
  struct Message {
    bool is_static;
    std::vector<geometry_msgs::TransformStamped> transforms;
  };
  std::string name;
  std::string sent;  ///< description
  Answers answers;   ///< to a valid cloud in `frame` at `stamp`
  /// @param frame a new frame, unknown to tf. @param stamp of the cloud.
  std::function<std::vector<Message>(const std::string& frame, const ros::Time& stamp, Dice&)> make;
};
const std::vector<TransformKind>& transformKinds();

/// A path for ~save_map, unusual or not writable.
struct PathKind {
  std::string name;
  std::string sent;  ///< description
  bool written;      ///< whether the map can be written there
  /// @param folder a writable folder.
  std::function<std::string(const std::string& folder)> make;
};
const std::vector<PathKind>& pathKinds();

/// Changes of settings, some of them not allowed.
struct SettingsKind {
  std::string name;
  std::string sent;  ///< description
  std::function<void(dynamic_reconfigure::Config&, Dice&)> change;
  bool refused = true;  ///< always; else it may be applied
};
const std::vector<SettingsKind>& settingsKinds();

/// A query of the map, honest or wrong.
struct QueryKind {
  struct Answer {
    bool called, success;
    std::string message;
    std::size_t entries;  ///< of the arrays of the answer
  };
  std::string name;
  std::string sent;  ///< description
  bool answered;     ///< whether it is answered, not refused
  /// Calls one of the services for queries. @param space of the services.
  std::function<Answer(const std::string& space, Dice&)> ask;
};
const std::vector<QueryKind>& queryKinds();

/// A valid cloud of class table `toy` with the fields that every set of settings reads: x, y, z, label,
/// rgb, scores (one per class), labels and label_scores (the most probable three), ns and seconds (times).
sensor_msgs::PointCloud2 honestCloud(const std::string& frame, const ros::Time& stamp, Dice& dice);

/// A transform from `frame` to `parent`.
geometry_msgs::TransformStamped honestTransform(const std::string& parent, const std::string& frame,
                                                const ros::Time& stamp, double x = 0.0);

/// Swaps the byte order of all values of the cloud, and sets is_bigendian.
void swapBytes(sensor_msgs::PointCloud2& cloud);

/// Adds alpha to packed colours.
void setAlpha(sensor_msgs::PointCloud2& cloud, Dice& dice);

/// A message of corrected_path, to a mapper with a journal.
struct CorrectionKind {
  std::string name;
  std::string sent;  ///< description
  bool used;         ///< whether it is used, not refused
  /// @param stamp of the last cloud; some before it are 0.1 s apart.
  std::function<nav_msgs::Path(const ros::Time& stamp, Dice&)> make;
};
const std::vector<CorrectionKind>& correctionKinds();

/// Any other attack, implemented by hostile_test.
struct DeedKind {
  std::string name;
  std::string sent;  ///< description
};
const std::vector<DeedKind>& deedKinds();

}  // namespace bki_mapping::hostile
