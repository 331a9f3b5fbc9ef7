/// @file Organised clouds of a spinning lidar in a scene of boxes, with the true direction of every beam.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

namespace bki_mapping::ros_interface {

/// Level ground and boxes, relative to the sensor, in axes of which z is up [m].
struct BoxScene {
  static constexpr float kGround = -1.7f;
  std::vector<Eigen::AlignedBox3f> boxes;

  /// A wall, a person and a car.
  static BoxScene street() {
    const auto box = [](float x, float y, float z, float to_x, float to_y, float to_z) {
      return Eigen::AlignedBox3f(Eigen::Vector3f(x, y, z), Eigen::Vector3f(to_x, to_y, to_z));
    };
    return {{box(9, -8, kGround, 11, 8, 6), box(2.2f, 2.2f, kGround, 3.2f, 3.2f, 0.1f),
             box(-6, -3, kGround, -4, -1.5f, -0.2f)}};
  }

  /// The distance to a box along a ray; infinity if it misses.
  static float distance(const Eigen::AlignedBox3f& box, const Eigen::Vector3f& from,
                        const Eigen::Vector3f& way) {
    const Eigen::Array3f a = (box.min() - from).array() / way.array(),
                         b = (box.max() - from).array() / way.array();
    const float near = a.min(b).maxCoeff(), far = a.max(b).minCoeff();
    return near > 0.0f && near < far ? near : std::numeric_limits<float>::infinity();
  }

  float distance(const Eigen::Vector3f& from, const Eigen::Vector3f& way) const {
    float nearest = way.z() < 0.0f ? (kGround - from.z()) / way.z() : std::numeric_limits<float>::infinity();
    for (const auto& box : boxes) nearest = std::min(nearest, distance(box, from, way));
    return nearest;
  }
};

/// A lidar, and how its driver writes clouds.
struct SpinningLidar {
  std::size_t rings = 32, firings = 512;
  std::function<double(double)> elevation = [](double share) { return 0.26 - 0.7 * share; };
  std::function<double(std::size_t)> stagger = [](std::size_t) { return 0.0; };  ///< of a ring [rad]
  double start = 0.3;                 ///< azimuth of the first firing [rad]
  double turn = 2.0 * M_PI;           ///< the sector that firings cover [rad]
  double jitter = 2e-4;               ///< standard deviation of directions, in elevation and in azimuth [rad]
  double height = 0.0, radius = 0.0;  ///< where beams start: above the origin, and beside the axis [m]
  double lost = 0.0;                  ///< fraction of beams without a return although they meet something
  float max_range = 14.0f;
  bool firings_are_rows = false;
  Eigen::Matrix3f mount = Eigen::Matrix3f::Identity();  ///< from the lidar's axes to the scene's
  Eigen::Matrix3f frame = Eigen::Matrix3f::Identity();  ///< from the scene's axes to the cloud's

  /// The angle between neighbouring beams [rad].
  double spacing() const {
    double least = turn / static_cast<double>(firings);
    for (std::size_t r = 1; r < rings; ++r)
      least = std::min(least, std::abs(elevationOf(r) - elevationOf(r - 1)));
    return least;
  }
  double elevationOf(std::size_t ring) const {
    return elevation(static_cast<double>(ring) / static_cast<double>(rings - 1));
  }
};

/// A cloud, row by row.
struct OrganisedCloud {
  std::size_t width;
  std::vector<Eigen::Vector3f> points;  ///< NaN without a return
  std::vector<Eigen::Vector3f> truth;   ///< the directions of all beams, in the cloud's frame

  std::vector<std::size_t> holes() const {
    std::vector<std::size_t> places;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (points[i].hasNaN()) places.push_back(i);
    }
    return places;
  }
};

inline OrganisedCloud sweep(const SpinningLidar& lidar, const BoxScene& scene, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0.0, lidar.jitter);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  const std::size_t count = lidar.rings * lidar.firings;
  OrganisedCloud cloud{lidar.firings_are_rows ? lidar.rings : lidar.firings, {}, {}};
  cloud.points.assign(count, Eigen::Vector3f::Constant(NAN));
  cloud.truth.resize(count);
  for (std::size_t r = 0; r < lidar.rings; ++r) {
    for (std::size_t f = 0; f < lidar.firings; ++f) {
      const double e = lidar.elevationOf(r) + normal(random);
      const double step = lidar.turn / static_cast<double>(lidar.firings);
      const double azimuth = lidar.start + static_cast<double>(f) * step;
      const double a = azimuth + lidar.stagger(r) + normal(random) / std::cos(e);
      const Eigen::Vector3d way(std::cos(a) * std::cos(e), std::sin(a) * std::cos(e), std::sin(e));
      const Eigen::Vector3d from(lidar.radius * std::cos(a), lidar.radius * std::sin(a), lidar.height);
      const Eigen::Vector3f in_scene = lidar.mount * way.cast<float>();
      const Eigen::Vector3f start = lidar.mount * from.cast<float>();
      const float range = scene.distance(start, in_scene);
      const std::size_t i = lidar.firings_are_rows ? f * lidar.rings + r : r * lidar.firings + f;
      cloud.truth[i] = lidar.frame * in_scene;
      if (range < lidar.max_range && uniform(random) >= lidar.lost) {
        cloud.points[i] = lidar.frame * (start + range * in_scene);
      }
    }
  }
  return cloud;
}

}  // namespace bki_mapping::ros_interface
