#include <algorithm>
#include <cmath>

#include "kinds.h"

namespace bki_mapping::hostile {
namespace {

using nav_msgs::Path;

/// Poses near those of the last clouds, as a SLAM system would send them.
Path honestPath(const ros::Time& stamp, Dice& dice) {
  Path path;
  path.header.frame_id = "map";
  for (int n = 0; n < 10; ++n) {
    geometry_msgs::PoseStamped pose;
    pose.header.stamp = stamp - ros::Duration(0.1 * (9 - n));
    pose.pose.position.x = dice.between(-1.0, 6.0);
    pose.pose.position.y = dice.between(-1.0, 1.0);
    pose.pose.orientation.w = 1.0;
    path.poses.push_back(pose);
  }
  return path;
}

CorrectionKind kind(const std::string& name, const std::string& sent, bool used,
                    const std::function<void(Path&, Dice&)>& change) {
  return {name, sent, used, [change](const ros::Time& stamp, Dice& dice) {
            Path path = honestPath(stamp, dice);
            change(path, dice);
            return path;
          }};
}

}  // namespace

const std::vector<CorrectionKind>& correctionKinds() {
  static const std::vector<CorrectionKind> kinds = {
      kind("path/honest", "poses near those of the last clouds", true, [](Path&, Dice&) {}),
      kind("path/shuffled", "poses in any order, some of them twice", true,
           [](Path& path, Dice& dice) {
             for (int n = 0; n < 5; ++n) path.poses.push_back(path.poses[dice.below(10)]);
             for (std::size_t n = path.poses.size(); n > 1; --n) {
               std::swap(path.poses[n - 1], path.poses[dice.below(n)]);
             }
           }),
      kind("path/jumping", "poses that lie 100 m to 1 km apart", true,
           [](Path& path, Dice& dice) {
             for (auto& pose : path.poses) pose.pose.position.x = dice.between(-1000.0, 1000.0);
           }),
      kind("path/far", "a pose at 1e6 to 1e300 m", true,
           [](Path& path, Dice& dice) {
             path.poses.back().pose.position.y = dice.oneOf<double>({1e6, -1e9, 1e12, 1e300, -1e308});
           }),
      kind("path/turning", "poses that are turned at random", true,
           [](Path& path, Dice& dice) {
             for (auto& pose : path.poses) {
               const double angle = dice.between(-3.2, 3.2);
               pose.pose.orientation.z = std::sin(0.5 * angle);
               pose.pose.orientation.w = std::cos(0.5 * angle);
             }
           }),
      kind("path/long", "200,000 poses", true,
           [](Path& path, Dice&) {
             const auto first = path.poses.front();
             for (int n = 0; n < 200'000; ++n) {
               path.poses.push_back(first);
               path.poses.back().header.stamp += ros::Duration(1e-6 * n);
             }
           }),
      kind("path/frame", "another frame, an empty or a very long one", false,
           [](Path& path, Dice& dice) {
             path.header.frame_id = dice.oneOf<std::string>({"odom", "", "/", std::string(100'000, 'm')});
           }),
      kind("path/no_stamp", "a pose without a stamp", false,
           [](Path& path, Dice& dice) { path.poses[dice.below(10)].header.stamp = ros::Time(); }),
      kind("path/other_times", "poses of times without clouds", false,
           [](Path& path, Dice& dice) {
             for (auto& pose : path.poses) pose.header.stamp.sec = dice.oneIn(2) ? 4'294'967'295u : 1u;
           }),
      kind("path/nan", "a position that is NaN or infinite", false,
           [](Path& path, Dice& dice) {
             path.poses[dice.below(10)].pose.position.z = dice.oneIn(2) ? kNan : -kInf;
           }),
      kind("path/quaternion", "a quaternion of zeros, NaN or length 2", false,
           [](Path& path, Dice& dice) {
             path.poses[dice.below(10)].pose.orientation.w = dice.oneOf<double>({0.0, kNan, 2.0});
           }),
  };
  return kinds;
}

}  // namespace bki_mapping::hostile
