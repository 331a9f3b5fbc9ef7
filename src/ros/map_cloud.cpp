#include "ros/map_cloud.h"

#include <new>
#include <variant>

#include "bki_mapping/core/named_parameter.h"
#include "bki_mapping/mapping/semantic_mapper.h"

namespace bki_mapping::ros_interface {

std::optional<Refusal> mapCloud(const sensor_msgs::PointCloud2& cloud, const ScanReader& reader,
                                const PoseSource& poses, const ros::Time& now, const GridGeometry& geometry,
                                const Remedies& remedies,
                                const std::function<void(const PlacedScan&)>& integrate) {
  if (cloud.width == 0 || cloud.height == 0) {
    return Refusal{DropReason::kEmpty, "it has no points; check the sensor"};
  }
  try {
    const auto placed = reader.read(cloud, poses, now);
    if (const auto* missing = std::get_if<MissingPose>(&placed)) {
      return Refusal{missing->reason, missing->why + remedies.missing_pose};
    }
    const auto& scan = std::get<PlacedScan>(placed);
    if (!geometry.contains(scan.scan.origin)) {
      const std::string& map_frame = reader.mapFrame();
      return Refusal{DropReason::kBadTransform, "tf puts the sensor so far from the origin of '" + map_frame +
                                                    "' (" + numberText(scan.scan.origin.norm()) +
                                                    " m) that the map cannot hold it; correct the " +
                                                    "publisher of the transforms from '" + map_frame +
                                                    "' to '" + shortText(cloud.header.frame_id) + "'"};
    }
    integrate(scan);
    return std::nullopt;
  } catch (const ScanRefused& refused) {
    const bool memory = refused.reason() == ScanRefused::Reason::kMemory;
    return Refusal{memory ? DropReason::kMemory : DropReason::kTooLarge,
                   refused.what() + (memory ? remedies.memory : std::string())};
  } catch (const std::bad_alloc&) {
    return Refusal{DropReason::kMemory,
                   "the computer's memory does not hold it; set memory_limit, or send smaller clouds"};
  } catch (const std::exception& fault) {
    return Refusal{DropReason::kBadCloud,
                   std::string(fault.what()) + "; check the cloud's source and the settings of the input"};
  }
}

}  // namespace bki_mapping::ros_interface
