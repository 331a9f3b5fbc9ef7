#include <nav_msgs/Path.h>

#include "ros/map_publisher.h"

namespace bki_mapping::ros_interface {
namespace {

/// The poses of the sensor at integrated scans.
class Trajectory : public MapPublisher {
 public:
  explicit Trajectory(const PublisherContext& context) {
    publisher_ = context.advertiseWhole<nav_msgs::Path>("trajectory", *this);
  }

 private:
  void publishNew(const ServerSnapshot& snapshot) override {
    nav_msgs::Path path;
    path.header = snapshot.header;
    path.poses.resize(snapshot.trajectory.size());
    for (std::size_t n = 0; n < path.poses.size(); ++n) {
      path.poses[n].header.frame_id = snapshot.header.frame_id;
      path.poses[n].header.stamp = snapshot.trajectory[n].stamp;
      path.poses[n].pose = snapshot.trajectory[n].pose;
    }
    publisher_.publish(path);
  }
};

}  // namespace

std::unique_ptr<MapPublisher> makeTrajectory(const PublisherContext& context) {
  return std::make_unique<Trajectory>(context);
}

}  // namespace bki_mapping::ros_interface
