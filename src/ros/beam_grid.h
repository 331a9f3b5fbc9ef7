/// @file The directions of all beams of an organised cloud, estimated from those that returned.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "ros/ring_axis.h"

namespace bki_mapping::ros_interface {

/// A grid of rings and firings. A beam has the elevation of its ring, and the azimuth of its firing plus an
/// offset of its ring. A direction is known only if the returns pin it down to within half the spacing of
/// beams: at least two of its ring and two of its firing agree with the grid, few others disagree, and the
/// estimate's standard deviation is below a sixth of the spacing.
class BeamGrid {
 public:
  /// @param returns their places are below `rings` and `firings`.
  BeamGrid(const RingAxis& axis, const std::vector<GridReturn>& returns, std::size_t rings,
           std::size_t firings);

  /// Whether the returns have the directions of such a grid.
  bool fits() const { return fits_; }
  /// The direction of a beam, of length 1; no value if the returns do not pin it down.
  std::optional<Eigen::Vector3f> direction(std::size_t ring, std::size_t firing) const;

 private:
  /// The beams of a ring or of a firing.
  struct Line {
    /// Azimuth of a firing, or offset of a ring, as a vector of length 1; 0 if not known.
    Eigen::Vector2f turn = Eigen::Vector2f::Zero();
    Eigen::Vector2f sum = Eigen::Vector2f::Zero();
    float returns = 0.0f, wrong = 0.0f;  ///< with a known direction; those of them that are not at it
    bool known() const { return !turn.isZero(); }
    bool pinned() const;
    void average();
  };
  struct Ring : Line {
    double sines = 0.0;
    float all = 0.0f;                                 ///< number of returns
    float sine = 0.0f, cosine = 1.0f;                 ///< of the elevation
    Eigen::Vector4f slope = Eigen::Vector4f::Zero();  ///< mean of RingSight::slope
  };
  struct Seen {
    Eigen::Vector2f horizontal;
    float sine;
    std::uint32_t ring, firing;
  };

  void findElevations(const std::vector<GridReturn>& returns);
  void findAzimuths();
  /// The azimuths of firings from rings with a known offset. @param again of those that are known, without
  /// returns that do not agree with them.
  /// @return whether more are known than before.
  bool turnFirings(bool again);
  bool turnRings(bool again);
  void findSpacing();
  void judge();
  /// The squared distance of a return's direction from that of the grid [rad^2].
  float error2(const Seen& s) const;
  bool agrees(const Seen& s) const {
    return rings_[s.ring].known() && firings_[s.firing].known() && error2(s) <= tolerance_ * tolerance_;
  }
  Eigen::Vector3f inAxes(const Ring& ring, const Line& firing) const;

  RingAxis axis_;
  std::vector<Seen> seen_;
  std::vector<Ring> rings_;
  std::vector<Line> firings_;
  float tolerance_ = 0.0f;  ///< half the spacing of beams [rad]
  float variance_ = 0.0f;   ///< of one coordinate of a direction [rad^2]
  bool fits_ = false;
};

}  // namespace bki_mapping::ros_interface
