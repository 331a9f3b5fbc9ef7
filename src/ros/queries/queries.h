/// @file What the services for queries answer, one file each. docs/queries.md has the queries.
#pragma once

#include <bki_mapping/CastRays.h>
#include <bki_mapping/CheckSpace.h>
#include <bki_mapping/GetDistances.h>
#include <bki_mapping/GetFrontiers.h>
#include <bki_mapping/GetNearestObstacles.h>
#include <bki_mapping/GetSection.h>
#include <bki_mapping/QueryPoints.h>

#include <Eigen/Geometry>
#include <optional>

#include "ros/recent_map.h"

namespace bki_mapping::ros_interface {

// Each fills in an empty answer.
// @throws std::invalid_argument if the request is wrong or too large, before memory is taken.
void query(const QueriedMap& map, const QueryPoints::Request& asked, QueryPoints::Response& answer);
void query(const QueriedMap& map, const CastRays::Request& asked, CastRays::Response& answer);
void query(const QueriedMap& map, const CheckSpace::Request& asked, CheckSpace::Response& answer);
void query(const QueriedMap& map, const GetNearestObstacles::Request& asked,
           GetNearestObstacles::Response& answer);
void query(const QueriedMap& map, const GetSection::Request& asked, GetSection::Response& answer);
void query(const QueriedMap& map, const GetFrontiers::Request& asked, GetFrontiers::Response& answer);
void query(const QueriedMap& map, const GetDistances::Request& asked, GetDistances::Response& answer);

/// The registry: calls offer(name, service) for each of them.
template <typename Offer>
void forEachQuery(const Offer& offer) {
  offer("query_points", QueryPoints());
  offer("cast_rays", CastRays());
  offer("check_space", CheckSpace());
  offer("get_nearest_obstacles", GetNearestObstacles());
  offer("get_section", GetSection());
  offer("get_frontiers", GetFrontiers());
  offer("get_distances", GetDistances());
}

/// The box to which a request limits the frontiers; without: it asks for those of the whole map.
std::optional<Eigen::AlignedBox3d> boxOf(const GetFrontiers::Request& asked);

}  // namespace bki_mapping::ros_interface
