#include "bki_mapping/query/queries.h"

#include <limits>

#include "queries.h"
#include "requests.h"

namespace bki_mapping::ros_interface {

void query(const QueriedMap& map, const CastRays::Request& asked, CastRays::Response& answer) {
  static_assert(static_cast<int>(RayEnd::kNothing) == CastRays::Response::NOTHING &&
                    static_cast<int>(RayEnd::kOccupied) == CastRays::Response::OCCUPIED &&
                    static_cast<int>(RayEnd::kUnknown) == CastRays::Response::UNKNOWN,
                "the message has the same values");
  const std::size_t count = asked.directions.size();
  checkBatch(count, CastRays::Request::MOST_RAYS, "rays");
  checkCount(asked.origins, count, "origins");
  checkCount(asked.lengths, count, "lengths");
  const RayStops stops = {classesOf(map.classes, asked.classes, asked.all_but), asked.stop_at_unknown != 0};
  std::vector<Ray> rays;
  rays.reserve(count);
  for (std::size_t n = 0; n < count; ++n) {
    rays.push_back(
        {toVector(valueFor(asked.origins, n)), toVector(asked.directions[n]), valueFor(asked.lengths, n)});
  }
  std::vector<RayHit> hits(count);
  castRays(map.states, rays, stops, hits);
  answer.header = map.header;
  const Eigen::Vector3d nowhere = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  for (const RayHit& hit : hits) {
    answer.met.push_back(static_cast<std::int8_t>(hit.end));
    answer.class_name.push_back(map.classes.nameOf(hit.label));
    answer.length.push_back(hit.length);
    answer.first_unknown.push_back(hit.first_unknown);
    answer.voxel.push_back(
        fromVector(hit.end == RayEnd::kNothing ? nowhere : map.states.geometry().voxelCentre(hit.voxel)));
  }
}

}  // namespace bki_mapping::ros_interface
