#include "ros/ring_axis.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace bki_mapping::ros_interface {
namespace {

/// Five unknowns need no more returns than this.
constexpr std::size_t kMostSamples = 8192;
/// Directions within rings differ at least this much [rad], and beams are taken to start within this of the
/// origin [m] unless returns say otherwise (standard deviations).
constexpr double kDirectionJitter = 1e-4, kOffset = 2e-3;

/// The step through the returns, odd so that it meets all rows and columns of grids whose sizes are even.
std::size_t stepThrough(std::size_t count) {
  return count <= kMostSamples ? 1 : (count / kMostSamples) | 1;
}

/// Axes whose last row is `axis`.
Eigen::Matrix3f axesAbout(const Eigen::Vector3f& axis) {
  Eigen::Matrix3f axes;
  axes.row(2) = axis.normalized();
  axes.row(0) = axis.unitOrthogonal();
  axes.row(1) = axes.row(2).cross(axes.row(0));
  return axes;
}

/// The axes, tilted so that the last row moves by `change` along the others.
Eigen::Matrix3f tilted(Eigen::Matrix3f axes, const Eigen::Vector2f& change) {
  axes.row(2) = (axes.row(2) + change.x() * axes.row(0) + change.y() * axes.row(1)).normalized();
  axes.row(0) = (axes.row(0) - axes.row(0).dot(axes.row(2)) * axes.row(2)).normalized();
  axes.row(1) = axes.row(2).cross(axes.row(0));
  return axes;
}

/// Sums over the returns of one ring.
struct RingSums {
  double count = 0.0, sine = 0.0;
  Eigen::Vector4d slope = Eigen::Vector4d::Zero();
};

/// Sums over returns of what one step of Gauss and Newton needs, within rings.
class NormalEquations {
 public:
  explicit NormalEquations(std::size_t rings) : rings_(rings) {}

  void add(std::size_t ring, const RingSight& sight) {
    const Eigen::Vector4d slope = sight.slope.cast<double>();
    const double sine = static_cast<double>(sight.sine);
    RingSums& sums = rings_[ring];
    sums.count += 1.0;
    sums.sine += sine;
    sums.slope += slope;
    count_ += 1.0;
    squares_ += sine * sine;
    right_ += sine * slope;
    left_ += slope * slope.transpose();
  }

  /// @param[out] spread standard deviation of the sines within rings, before the step.
  /// @return whether there are enough returns.
  bool solve(Eigen::Vector4d& step, Eigen::Matrix4d& inverse, double& spread) {
    double used = 0.0;
    for (const RingSums& sums : rings_) {
      if (sums.count == 0.0) continue;
      used += 1.0;
      squares_ -= sums.sine * sums.sine / sums.count;
      right_ -= sums.slope * (sums.sine / sums.count);
      left_ -= sums.slope * sums.slope.transpose() / sums.count;
    }
    const double freedom = count_ - used - 4.0;
    if (freedom < kLeastFreedom) return false;
    left_.diagonal() += Eigen::Vector4d(1e-6, 1e-6, 1.0, 1.0) * std::pow(kDirectionJitter / kOffset, 2);
    inverse = left_.inverse();
    step = -inverse * right_;
    spread = std::sqrt(std::max(squares_, 0.0) / freedom);
    return inverse.allFinite() && step.allFinite();
  }

  /// The mean sine of a ring after a step; NaN if the ring has no return.
  float meanAfter(const Eigen::Vector4d& step, std::size_t ring) const {
    const RingSums& sums = rings_[ring];
    return static_cast<float>((sums.sine + sums.slope.dot(step)) / sums.count);
  }

 private:
  std::vector<RingSums> rings_;
  double count_ = 0.0, squares_ = 0.0;
  Eigen::Vector4d right_ = Eigen::Vector4d::Zero();
  Eigen::Matrix4d left_ = Eigen::Matrix4d::Zero();
};

}  // namespace

RingSight RingAxis::sightOf(const Eigen::Vector3f& point) const {
  const Eigen::Vector3f p = axes * point;
  const float flat = p.head<2>().norm(), out = flat - radius, up = p.z() - height;
  const float range = std::sqrt(out * out + up * up);
  const float cosine = out / range, sine = up / range;
  const Eigen::Vector2f horizontal =
      flat > 0.0f ? Eigen::Vector2f(p.head<2>() * (cosine / flat)) : Eigen::Vector2f(0.0f, 0.0f);
  return {
      horizontal, sine, {horizontal.x(), horizontal.y(), -cosine * cosine / range, sine * cosine / range}};
}

double flatness(const std::vector<GridReturn>& returns, std::size_t rings, Eigen::Vector3f& axis) {
  std::vector<Eigen::Vector4d> sums(rings, Eigen::Vector4d::Zero());  // of directions, and their number
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < returns.size(); i += stepThrough(returns.size())) {
    const Eigen::Vector3d direction = returns[i].point.normalized().cast<double>();
    sums[returns[i].ring] += direction.homogeneous();
    scatter += direction * direction.transpose();
  }
  for (const Eigen::Vector4d& sum : sums) {
    if (sum[3] > 0.0) scatter -= sum.head<3>() * sum.head<3>().transpose() / sum[3];
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scatter);
  axis = solver.eigenvectors().col(0).cast<float>();
  const Eigen::Vector3d& values = solver.eigenvalues();  // ascending
  const bool enough = values.allFinite() && values[1] > 1e-9;
  return enough ? std::max(values[0], 0.0) / values[1] : std::numeric_limits<double>::infinity();
}

std::optional<RingAxis> fitRingAxis(const std::vector<GridReturn>& returns, std::size_t rings,
                                    const Eigen::Vector3f& start) {
  constexpr int kSteps = 5;
  RingAxis axis;
  axis.axes = axesAbout(start);
  std::vector<float> means(rings, 0.0f);
  auto limit = std::numeric_limits<float>::infinity();
  for (int n = 0; n < kSteps; ++n) {
    NormalEquations equations(rings);
    for (std::size_t i = 0; i < returns.size(); i += stepThrough(returns.size())) {
      const RingSight sight = axis.sightOf(returns[i].point);
      const std::size_t ring = returns[i].ring;
      if (std::abs(sight.sine - means[ring]) <= limit) equations.add(ring, sight);
    }
    Eigen::Vector4d step;
    Eigen::Matrix4d inverse;
    double spread = 0.0;
    if (!equations.solve(step, inverse, spread)) return std::nullopt;
    const Eigen::Vector4f change = step.cast<float>();
    axis.axes = tilted(axis.axes, change.head<2>());
    axis.height += change[2];
    axis.radius += change[3];
    axis.covariance = inverse.cast<float>();
    for (std::size_t r = 0; r < rings; ++r) means[r] = equations.meanAfter(step, r);
    limit = static_cast<float>(3.0 * std::max(spread, kDirectionJitter));
  }
  return axis;
}

}  // namespace bki_mapping::ros_interface
