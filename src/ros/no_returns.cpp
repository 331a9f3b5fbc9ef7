#include "ros/no_returns.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <variant>

#include "mapping/scan_preprocessor.h"
#include "ros/beam_grid.h"
#include "ros/ring_axis.h"

namespace bki_mapping::ros_interface {
namespace {

/// Returns nearer than this say little about directions, because beams start near the sensor's origin [m].
constexpr float kNearest = 0.5f;
/// Beams start within this of the sensor's origin [m]; where the returns say otherwise, its frame is wrong.
constexpr float kOffCentre = 0.1f;
/// Rings are flat up to this fraction.
constexpr double kFlat = 0.01;

struct Grid {
  std::vector<GridReturn> returns;  ///< with rows for rings, unless chooseRings says otherwise
  std::vector<std::size_t> holes;
  std::size_t rings, firings;
  bool rings_are_rows = true;
};

Grid sort(const std::vector<Eigen::Vector3f>& points, const std::vector<Answer>& answers, std::size_t width,
          const Eigen::Vector3f& sensor) {
  Grid grid;
  grid.rings = points.size() / width;
  grid.firings = width;
  grid.returns.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (answers[i] == Answer::kNothing) grid.holes.push_back(i);
    if (answers[i] != Answer::kReturn) continue;
    const Eigen::Vector3f point = points[i] - sensor;
    const float square = point.squaredNorm();
    if (!(square >= kNearest * kNearest) || !std::isfinite(square)) continue;
    grid.returns.push_back(
        {point, static_cast<std::uint32_t>(i / width), static_cast<std::uint32_t>(i % width)});
  }
  return grid;
}

void transpose(Grid& grid) {
  for (GridReturn& r : grid.returns) std::swap(r.ring, r.firing);
  std::swap(grid.rings, grid.firings);
  grid.rings_are_rows = !grid.rings_are_rows;
}

/// Takes rows or columns for rings, whichever are flatter. @return how flat they are.
double chooseRings(Grid& grid, Eigen::Vector3f& axis) {
  Eigen::Vector3f axis_of_columns;
  const double rows = flatness(grid.returns, grid.rings, axis);
  transpose(grid);
  const double columns = flatness(grid.returns, grid.rings, axis_of_columns);
  if (columns < rows) {
    axis = axis_of_columns;
    return columns;
  }
  transpose(grid);
  return rows;
}

std::variant<BeamGrid, NoDirection> beamsOf(Grid& grid) {
  Eigen::Vector3f axis;
  const double flat = chooseRings(grid, axis);
  if (!std::isfinite(flat)) return NoDirection::kFewReturns;
  if (!(flat < kFlat)) return NoDirection::kNoRings;
  const auto fitted = fitRingAxis(grid.returns, grid.rings, axis);
  if (!fitted) return NoDirection::kFewReturns;
  if (!(std::hypot(fitted->height, fitted->radius) < kOffCentre)) return NoDirection::kNoRings;
  BeamGrid beams(*fitted, grid.returns, grid.rings, grid.firings);
  if (!beams.fits()) return NoDirection::kNoRings;
  return beams;
}

}  // namespace

const char* explain(NoDirection reason) {
  switch (reason) {
    case NoDirection::kUnorganised:
      return "the cloud has no rows and columns that tell where these beams point; let the driver publish "
             "organised clouds, or set clear_no_returns to false";
    case NoDirection::kNoRings:
      return "neither the rows nor the columns of the cloud are rings of a spinning lidar at the sensor's "
             "frame; set sensor_frame_id to the frame where beams start, take clouds that are not yet "
             "corrected for motion, or set clear_no_returns to false";
    case NoDirection::kFewReturns:
      break;
  }
  return "too few of the beams around them returned to tell where they point; this is normal for rings that "
         "see only sky";
}

Answer answerOf(const Eigen::Vector3d& point, const Eigen::Vector3d& sensor) {
  constexpr double kRadius = static_cast<double>(kSensorRadius);
  const double nearest2 = std::min(point.squaredNorm(), (point - sensor).squaredNorm());
  if (std::isfinite(nearest2) || point.allFinite()) {
    return nearest2 < kRadius * kRadius ? Answer::kNothing : Answer::kReturn;
  }
  return !point.hasNaN() && point.array().isInf().count() == 1 ? Answer::kDirection : Answer::kNothing;
}

Eigen::Vector3f directionOf(const Eigen::Vector3f& point) {
  Eigen::Vector3f direction = Eigen::Vector3f::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    if (std::isinf(point[axis])) direction[axis] = point[axis] > 0.0f ? 1.0f : -1.0f;
  }
  return direction;
}

Holes directionsOfHoles(const std::vector<Eigen::Vector3f>& points, const std::vector<Answer>& answers,
                        std::size_t width, const Eigen::Vector3f& sensor) {
  Holes found;
  if (width == 0) return found;
  Grid grid = sort(points, answers, width, sensor);
  if (grid.holes.empty()) return found;
  found.directions.assign(grid.holes.size(), Eigen::Vector3f::Zero());
  found.same_firing = grid.holes;
  const auto result = beamsOf(grid);
  const BeamGrid* beams = std::get_if<BeamGrid>(&result);
  if (!beams) {
    found.unknown = std::get<NoDirection>(result);
    return found;
  }
  const std::size_t step_of_ring = grid.rings_are_rows ? width : 1,
                    step_of_firing = grid.rings_are_rows ? 1 : width;
  std::vector<std::size_t> of_firing(grid.firings);
  for (const GridReturn& r : grid.returns) {
    of_firing[r.firing] = r.ring * step_of_ring + r.firing * step_of_firing;
  }
  for (std::size_t i = 0; i < grid.holes.size(); ++i) {
    const std::size_t row = grid.holes[i] / width, column = grid.holes[i] % width;
    const std::size_t firing = grid.rings_are_rows ? column : row;
    if (const auto direction = beams->direction(grid.rings_are_rows ? row : column, firing)) {
      found.directions[i] = *direction;
      found.same_firing[i] = of_firing[firing];
    } else {
      found.unknown = NoDirection::kFewReturns;
    }
  }
  return found;
}

}  // namespace bki_mapping::ros_interface
