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
  void publishNew(const MapSnapshot& snapshot) override {
    nav_msgs::Path path;
    path.header = snapshot.header;
    path.poses = snapshot.trajectory;
    publisher_.publish(path);
  }
};

}  // namespace

std::unique_ptr<MapPublisher> makeTrajectory(const PublisherContext& context) {
  return std::make_unique<Trajectory>(context);
}

}  // namespace bki_mapping::ros_interface
