#include "ros/beam_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace bki_mapping::ros_interface {
namespace {

/// Smallest standard deviation of directions [rad]: what rounding of coordinates makes of exact ones.
constexpr float kJitter = 1e-4f;
/// Lines of a grid are farther apart than this [rad].
constexpr float kLeastSpacing = 1e-4f;
/// Fractions of returns that may be off the grid: of a ring or firing that is used, and of a whole cloud.
constexpr float kWrongOfLine = 0.05f, kWrongOfCloud = 0.1f;
/// Offsets are carried from ring to ring through common firings at most this often.
constexpr int kMostLayers = 8;

using Turn = Eigen::Vector2f;  // a complex number

Turn times(const Turn& a, const Turn& b) {
  return {a.x() * b.x() - a.y() * b.y(), a.x() * b.y() + a.y() * b.x()};
}
Turn over(const Turn& a, const Turn& b) {
  return times(a, {b.x(), -b.y()});
}

/// The median of the gaps that are no coincidence; infinity if there is none.
float median(std::vector<float>& gaps) {
  gaps.erase(std::remove_if(gaps.begin(), gaps.end(), [](float gap) { return !(gap > kLeastSpacing); }),
             gaps.end());
  if (gaps.empty()) return std::numeric_limits<float>::infinity();
  const auto middle = gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2);
  std::nth_element(gaps.begin(), middle, gaps.end());
  return *middle;
}

template <typename Lines>
bool allKnown(const Lines& lines) {
  return std::all_of(lines.begin(), lines.end(), [](const auto& line) { return line.known(); });
}

}  // namespace

bool BeamGrid::Line::pinned() const {
  return returns - wrong >= 2.0f && wrong <= kWrongOfLine * returns;
}

void BeamGrid::Line::average() {
  const float length = sum.norm();
  if (length > 1e-3f) turn = sum / length;
  sum.setZero();
}

BeamGrid::BeamGrid(const RingAxis& axis, const std::vector<GridReturn>& returns, std::size_t rings,
                   std::size_t firings)
    : axis_(axis), rings_(rings), firings_(firings) {
  findElevations(returns);
  findAzimuths();
  judge();
}

void BeamGrid::findElevations(const std::vector<GridReturn>& returns) {
  seen_.reserve(returns.size());
  for (const GridReturn& r : returns) {
    const RingSight sight = axis_.sightOf(r.point);
    seen_.push_back({sight.horizontal, sight.sine, r.ring, r.firing});
    Ring& ring = rings_[r.ring];
    ring.all += 1.0f;
    ring.sines += static_cast<double>(sight.sine);
    ring.slope += sight.slope;
  }
  for (Ring& ring : rings_) {
    if (ring.all == 0.0f) continue;
    ring.sine = static_cast<float>(ring.sines) / ring.all;
    ring.cosine = std::sqrt(std::max(1.0f - ring.sine * ring.sine, 1e-6f));
    ring.slope /= ring.all;
  }
}

bool BeamGrid::turnFirings(bool again) {
  if (!again && allKnown(firings_)) return false;
  for (const Seen& s : seen_) {
    const Ring& ring = rings_[s.ring];
    Line& firing = firings_[s.firing];
    if (ring.known() && (again ? agrees(s) : !firing.known())) firing.sum += over(s.horizontal, ring.turn);
  }
  bool more = false;
  for (Line& firing : firings_) {
    const bool known = firing.known();
    firing.average();
    more |= firing.known() && !known;
  }
  return more;
}

bool BeamGrid::turnRings(bool again) {
  if (!again && allKnown(rings_)) return false;
  for (const Seen& s : seen_) {
    Ring& ring = rings_[s.ring];
    const Line& firing = firings_[s.firing];
    if (firing.known() && (again ? agrees(s) : !ring.known())) ring.sum += over(s.horizontal, firing.turn);
  }
  bool more = false;
  for (Ring& ring : rings_) {
    const bool known = ring.known();
    ring.average();
    more |= ring.known() && !known;
  }
  return more;
}

// From the ring with most returns: its firings, the rings with returns in these, and so on. Exact, where
// averaging all at once would converge slowly; then once more with all returns that agree.
void BeamGrid::findAzimuths() {
  const auto most = std::max_element(rings_.begin(), rings_.end(),
                                     [](const Ring& a, const Ring& b) { return a.all < b.all; });
  if (most == rings_.end() || most->all == 0.0f) return;
  most->turn = {1.0f, 0.0f};
  for (int n = 0; n < kMostLayers && turnFirings(false) && turnRings(false); ++n) {
  }
  findSpacing();
  turnFirings(true);
  turnRings(true);
}

void BeamGrid::findSpacing() {
  std::vector<float> gaps, elevations;
  for (const Ring& ring : rings_) {
    if (ring.known()) elevations.push_back(std::asin(ring.sine));
  }
  std::sort(elevations.begin(), elevations.end());
  for (std::size_t i = 1; i < elevations.size(); ++i) gaps.push_back(elevations[i] - elevations[i - 1]);
  const float between_rings = median(gaps);
  gaps.clear();
  for (std::size_t i = 1; i < firings_.size(); ++i) {
    if (!firings_[i].known() || !firings_[i - 1].known()) continue;
    const Turn turn = over(firings_[i].turn, firings_[i - 1].turn);
    gaps.push_back(std::abs(std::atan2(turn.y(), turn.x())));
  }
  tolerance_ = std::min(between_rings, median(gaps)) / 2.0f;
}

void BeamGrid::judge() {
  if (!std::isfinite(tolerance_)) return;
  float right = 0.0f, wrong = 0.0f, squares = 0.0f, unknowns = 4.0f;
  for (const Seen& s : seen_) {
    Ring& ring = rings_[s.ring];
    Line& firing = firings_[s.firing];
    if (!ring.known() || !firing.known()) continue;
    const float square = error2(s);
    ring.returns += 1.0f;
    firing.returns += 1.0f;
    if (square <= tolerance_ * tolerance_) {
      right += 1.0f;
      squares += square;
    } else {
      wrong += 1.0f;
      ring.wrong += 1.0f;
      firing.wrong += 1.0f;
    }
  }
  for (const Ring& ring : rings_) unknowns += ring.known() ? 2.0f : 0.0f;
  for (const Line& firing : firings_) unknowns += firing.known() ? 1.0f : 0.0f;
  const float freedom = 2.0f * right - unknowns;
  fits_ = freedom >= kLeastFreedom && wrong <= kWrongOfCloud * (right + wrong);
  if (fits_) variance_ = std::max(squares / freedom, kJitter * kJitter);
}

float BeamGrid::error2(const Seen& s) const {
  const Eigen::Vector3f seen(s.horizontal.x(), s.horizontal.y(), s.sine);
  return (inAxes(rings_[s.ring], firings_[s.firing]) - seen).squaredNorm();
}

Eigen::Vector3f BeamGrid::inAxes(const Ring& ring, const Line& firing) const {
  const Turn turn = ring.cosine * times(ring.turn, firing.turn);
  return {turn.x(), turn.y(), ring.sine};
}

std::optional<Eigen::Vector3f> BeamGrid::direction(std::size_t r, std::size_t f) const {
  const Ring& ring = rings_[r];
  const Line& firing = firings_[f];
  if (!fits_ || !ring.pinned() || !firing.pinned()) return std::nullopt;
  const Eigen::Vector3f direction = inAxes(ring, firing);
  // A far point on this beam has no slope for height and radius.
  const Eigen::Vector4f lever = Eigen::Vector4f(direction.x(), direction.y(), 0.0f, 0.0f) - ring.slope;
  const float elevation =
      1.0f / ring.returns + lever.dot(axis_.covariance * lever) / (ring.cosine * ring.cosine);
  const float azimuth = 1.0f / ring.returns + 1.0f / firing.returns;
  if (!(9.0f * variance_ * (elevation + azimuth) <= tolerance_ * tolerance_)) return std::nullopt;
  return axis_.fromAxes(direction);
}

}  // namespace bki_mapping::ros_interface
