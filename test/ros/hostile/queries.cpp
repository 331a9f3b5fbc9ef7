#include <bki_mapping/CastRays.h>
#include <bki_mapping/CheckSpace.h>
#include <bki_mapping/GetDistances.h>
#include <bki_mapping/GetFrontiers.h>
#include <bki_mapping/GetNearestObstacles.h>
#include <bki_mapping/GetSection.h>
#include <bki_mapping/QueryPoints.h>
#include <ros/service.h>

#include "kinds.h"

namespace bki_mapping::hostile {
namespace {

constexpr double kFar = 1e6;  ///< the edge of a cube with more than 1e9 voxels [m]

template <typename Message = geometry_msgs::Point>
Message xyz(double x, double y, double z) {
  Message message;
  message.x = x;
  message.y = y;
  message.z = z;
  return message;
}
using geometry_msgs::Vector3;

geometry_msgs::Point somewhere(Dice& dice) {
  return xyz(dice.between(-20.0, 20.0), dice.between(-20.0, 20.0), dice.between(-5.0, 5.0));
}
/// A point of which a coordinate is not finite.
geometry_msgs::Point nowhere(Dice& dice) {
  geometry_msgs::Point point = somewhere(dice);
  (dice.oneIn(2) ? point.x : point.z) = dice.oneOf<double>({kNan, kInf, -kInf});
  return point;
}
std::vector<geometry_msgs::Point> points(std::size_t count, Dice& dice) {
  std::vector<geometry_msgs::Point> some;
  while (some.size() < count) some.push_back(somewhere(dice));
  return some;
}

std::size_t entriesOf(const QueryPoints::Response& r) {
  return r.state.size() + r.variance.size();
}
std::size_t entriesOf(const CastRays::Response& r) {
  return r.met.size() + r.voxel.size();
}
std::size_t entriesOf(const CheckSpace::Response& r) {
  return r.free.size() + r.worst_class.size();
}
std::size_t entriesOf(const GetNearestObstacles::Response& r) {
  return r.distance.size();
}
std::size_t entriesOf(const GetSection::Response& r) {
  return r.grid.data.size() + r.label.size();
}
std::size_t entriesOf(const GetFrontiers::Response& r) {
  return r.centre.size() + r.voxels.size();
}
std::size_t entriesOf(const GetDistances::Response& r) {
  return r.distance.size() + r.gradient.size();
}

const char* nameOf(const QueryPoints&) {
  return "query_points";
}
const char* nameOf(const CastRays&) {
  return "cast_rays";
}
const char* nameOf(const CheckSpace&) {
  return "check_space";
}
const char* nameOf(const GetNearestObstacles&) {
  return "get_nearest_obstacles";
}
const char* nameOf(const GetSection&) {
  return "get_section";
}
const char* nameOf(const GetFrontiers&) {
  return "get_frontiers";
}
const char* nameOf(const GetDistances&) {
  return "get_distances";
}

/// A kind of query. @param fill completes the request.
template <typename Service>
QueryKind kind(const std::string& name, const std::string& sent, bool answered,
               const std::function<void(typename Service::Request&, Dice&)>& fill) {
  return {"query/" + name, sent, answered, [fill](const std::string& space, Dice& dice) {
            Service service;
            fill(service.request, dice);
            const bool called = ros::service::call(space + "/" + nameOf(service), service);
            const auto& answer = service.response;
            return QueryKind::Answer{called, answer.success != 0, answer.message, entriesOf(answer)};
          }};
}

void fill(CastRays::Request& asked, Dice& dice) {
  asked.origins = points(20, dice);
  for (std::size_t n = 0; n < asked.origins.size(); ++n) {
    asked.directions.push_back(xyz<Vector3>(dice.between(-1.0, 1.0), dice.between(-1.0, 1.0), 0.1));
  }
  asked.lengths = {dice.oneOf<double>({0.0, 5.0, kInf})};
  asked.classes = {"first", "third"};
  asked.all_but = dice.oneIn(2);
  asked.stop_at_unknown = dice.oneIn(2);
}
void fillWrong(CastRays::Request& asked, Dice& dice) {
  fill(asked, dice);
  switch (dice.below(6)) {
    case 0:
      return void(asked.directions[7] = Vector3());
    case 1:
      return void(asked.directions[7].y = kNan);
    case 2:
      return void(asked.lengths = {dice.oneOf<double>({-1.0, kNan, -kInf})});
    case 3:
      return asked.lengths.resize(3);
    case 4:
      return asked.origins.clear();
    default:
      return void(asked.origins[7] = dice.oneIn(2) ? nowhere(dice) : xyz(1e300, 0.0, 0.0));
  }
}

void fill(CheckSpace::Request& asked, Dice& dice) {
  asked.poses.resize(20);
  for (geometry_msgs::Pose& pose : asked.poses) {
    pose.position = somewhere(dice);
    if (dice.oneIn(2)) pose.orientation.z = pose.orientation.w = std::sqrt(0.5);
  }
  if (dice.oneIn(2)) {
    asked.sizes = {xyz<Vector3>(1.0, 0.5, 0.3)};
  } else {
    asked.radii.assign(asked.poses.size(), 0.5);
  }
  if (dice.oneIn(2)) asked.worst_first = {"second", "first"};
}
void fillWrong(CheckSpace::Request& asked, Dice& dice) {
  fill(asked, dice);
  asked.radii.clear();
  asked.sizes = {xyz<Vector3>(1.0, 0.5, 0.3)};
  switch (dice.below(7)) {
    case 0:
      return void(asked.sizes[0].y = dice.oneOf<double>({0.0, -1.0, kNan}));
    case 1:
      return asked.sizes.clear();
    case 2:
      return asked.sizes.resize(3, asked.sizes[0]);
    case 3:
      return void(asked.radii = {1.0});
    case 4:
      asked.sizes.clear();
      return void(asked.radii = {dice.oneOf<double>({0.0, -1.0, kNan})});
    case 5:
      return void(asked.poses[7].orientation.x = dice.oneOf<double>({3.0, kNan, kInf, 1e200}));
    default:
      return void(asked.poses[7].position = nowhere(dice));
  }
}

/// Names that the class table lacks.
std::vector<std::string> wrongNames(Dice& dice) {
  switch (dice.below(5)) {
    case 0:
      return {"first", "trolley"};
    case 1:
      return {std::string(100000, 'n')};
    case 2:
      return {std::string("\xff\0\n%s", 5), ""};
    case 3:
      return {"First", " first"};
    default:
      return std::vector<std::string>(300000, "first");
  }
}

}  // namespace

const std::vector<QueryKind>& queryKinds() {
  static const std::vector<QueryKind> kinds = {
      kind<QueryPoints>("points", "points in the map and far from it", true,
                        [](QueryPoints::Request& asked, Dice& dice) {
                          asked.points = points(200, dice);
                          asked.points.push_back(xyz(dice.oneOf<double>({1e6, -1e12, 1e308}), 0.0, 5e-324));
                        }),
      kind<QueryPoints>("points_not_finite", "a point that is NaN or infinite", false,
                        [](QueryPoints::Request& asked, Dice& dice) {
                          asked.points = points(200, dice);
                          asked.points[dice.below(200)] = nowhere(dice);
                        }),
      kind<QueryPoints>("points_many", "more points than a call may have", false,
                        [](QueryPoints::Request& asked, Dice&) {
                          asked.points.resize(QueryPoints::Request::MOST_POINTS + 1);
                        }),
      kind<CastRays>("rays", "rays of any length, also infinite", true,
                     [](CastRays::Request& asked, Dice& dice) { fill(asked, dice); }),
      kind<CastRays>("rays_wrong", "a ray without direction or length, or not finite, or too few lengths",
                     false, [](CastRays::Request& asked, Dice& dice) { fillWrong(asked, dice); }),
      kind<CheckSpace>("space", "boxes of any orientation, or spheres", true,
                       [](CheckSpace::Request& asked, Dice& dice) { fill(asked, dice); }),
      kind<CheckSpace>("space_wrong",
                       "shapes that are inside out, empty, not finite, or not rotated by a rotation", false,
                       [](CheckSpace::Request& asked, Dice& dice) { fillWrong(asked, dice); }),
      kind<CheckSpace>("space_huge", "a box or sphere of more than a billion voxels", false,
                       [](CheckSpace::Request& asked, Dice& dice) {
                         asked.poses.resize(1);
                         const double edge = dice.oneOf<double>({kFar, 1e300, kInf});
                         if (dice.oneIn(2)) {
                           asked.sizes = {xyz<Vector3>(edge, edge, edge)};
                         } else {
                           asked.radii = {edge};
                         }
                       }),
      kind<CastRays>("classes", "classes that the table lacks, or 300,000 names", false,
                     [](CastRays::Request& asked, Dice& dice) {
                       fill(asked, dice);
                       asked.classes = wrongNames(dice);
                     }),
      kind<CheckSpace>("classes_order", "the same as order of classes", false,
                       [](CheckSpace::Request& asked, Dice& dice) {
                         fill(asked, dice);
                         asked.worst_first = wrongNames(dice);
                       }),
      kind<GetNearestObstacles>("obstacles", "points, with and without a greatest distance", true,
                                [](GetNearestObstacles::Request& asked, Dice& dice) {
                                  asked.points = points(20, dice);
                                  asked.max_distance = dice.oneOf<double>({0.0, 3.0, 1e300, kInf});
                                  if (dice.oneIn(2)) asked.classes = {"second"};
                                }),
      kind<GetNearestObstacles>("obstacles_wrong",
                                "a point that is not finite, or beyond the grid, or no distance", false,
                                [](GetNearestObstacles::Request& asked, Dice& dice) {
                                  asked.points = points(20, dice);
                                  const std::size_t what = dice.below(3);
                                  if (what == 0) asked.points[7] = nowhere(dice);
                                  if (what == 1) asked.points[7] = xyz(0.0, 1e300, 0.0);
                                  if (what == 2) asked.max_distance = dice.oneOf<double>({-1.0, kNan, -kInf});
                                }),
      kind<GetSection>("section", "a horizontal or vertical section", true,
                       [](GetSection::Request& asked, Dice& dice) {
                         asked.vertical = dice.oneIn(2);
                         asked.start = xyz(dice.between(-10.0, 0.0), dice.between(-10.0, 0.0), -1.0);
                         asked.end = xyz(dice.between(0.1, 10.0), dice.between(0.1, 10.0), 2.0);
                       }),
      kind<GetSection>("section_wrong", "a section that is inside out, without width, or not finite", false,
                       [](GetSection::Request& asked, Dice& dice) {
                         asked.vertical = dice.oneIn(2);
                         asked.start = asked.end = xyz(1.0, 1.0, 1.0);
                         if (!asked.vertical) asked.end.y = -1.0;
                         if (dice.oneIn(2)) asked.start = nowhere(dice);
                       }),
      kind<GetSection>("section_huge", "a section of more than a billion cells", false,
                       [](GetSection::Request& asked, Dice& dice) {
                         asked.vertical = dice.oneIn(2);
                         const double edge = dice.oneOf<double>({kFar, 1e300});
                         asked.start = xyz(-edge, -edge, -edge);
                         asked.end = xyz(edge, edge, edge);
                       }),
      kind<GetFrontiers>("frontiers", "any least size and count, with and without a box", true,
                         [](GetFrontiers::Request& asked, Dice& dice) {
                           asked.min_size = dice.oneOf<std::uint32_t>({100, 1000, 4294967295u});
                           asked.max_count = dice.oneOf<std::uint32_t>({0, 1, 4294967295u});
                           if (dice.oneIn(2)) return;
                           asked.min = xyz(dice.between(-10.0, 0.0), dice.between(-10.0, 0.0), -1.0);
                           asked.max = xyz(dice.between(0.1, 10.0), dice.between(0.1, 10.0), 2.0);
                         }),
      kind<GetFrontiers>("frontiers_wrong", "a box that is inside out, not finite, or beyond the grid", false,
                         [](GetFrontiers::Request& asked, Dice& dice) {
                           asked.min = xyz(1.0, 1.0, 1.0);
                           asked.max = xyz(2.0, dice.oneOf<double>({0.0, 1e300}), 2.0);
                           if (dice.oneIn(2)) asked.max = nowhere(dice);
                         }),
      kind<GetDistances>("distances", "points, with and without unknown space as obstacle", true,
                         [](GetDistances::Request& asked, Dice& dice) {
                           asked.points = {somewhere(dice)};
                           asked.points.push_back(asked.points[0]);
                           asked.points[1].x += 0.2;
                           asked.max_distance = 1.0;
                           asked.unknown_is_obstacle = dice.oneIn(2);
                         }),
      kind<GetDistances>("distances_wrong", "a point that is not finite, or no greatest distance", false,
                         [](GetDistances::Request& asked, Dice& dice) {
                           asked.points = {somewhere(dice)};
                           asked.max_distance = 1.0;
                           if (dice.oneIn(2)) {
                             asked.points[0] = nowhere(dice);
                           } else {
                             asked.max_distance = dice.oneOf<double>({0.0, -1.0, kNan});
                           }
                         }),
      kind<GetDistances>("distances_huge",
                         "points so far apart that the region has more than a billion voxels", false,
                         [](GetDistances::Request& asked, Dice& dice) {
                           asked.points = {xyz(0.0, 0.0, 0.0), xyz(kFar, kFar, kFar)};
                           asked.max_distance = dice.oneOf<double>({1.0, 1e300, kInf});
                         }),
      kind<CheckSpace>("empty", "a batch without anything in it", true,
                       [](CheckSpace::Request& asked, Dice&) { asked.radii = {1.0}; }),
  };
  return kinds;
}

}  // namespace bki_mapping::hostile
