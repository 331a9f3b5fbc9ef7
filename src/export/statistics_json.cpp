#include "export/statistics_json.h"

#include "bki_mapping/core/class_table.h"
#include "export/ordered_json.h"

namespace bki_mapping {
namespace {

using Json = OrderedJson;

Json boxJson(const Eigen::AlignedBox3d& box) {
  if (box.isEmpty()) return nullptr;
  const Eigen::Vector3d &low = box.min(), &high = box.max();
  return {{"min", {low.x(), low.y(), low.z()}}, {"max", {high.x(), high.y(), high.z()}}};
}

Json driveJson(const DriveRecord& drive) {
  return {{"id", drive.id},
          {"name", drive.name},
          {"part", drive.part},
          {"scans", drive.scans},
          {"first_stamp_ns", drive.first_stamp},
          {"last_stamp_ns", drive.last_stamp},
          {"bounds", boxJson(drive.bounds)}};
}

}  // namespace

std::string statisticsJson(MapFile& file, const MapStatistics& found, const std::vector<DriveRecord>& drives,
                           const JournalStatistics& journal) {
  const MapInfo& info = file.info();
  const auto bytes = file.size().bytes;
  Json by_class = Json::object(), drive_list = Json::array();
  for (const SemanticClass& c : info.classes->classes()) {
    const auto count = found.occupied_by_class.find(c.id);
    by_class[c.name] = count == found.occupied_by_class.end() ? 0 : count->second;
  }
  for (const DriveRecord& drive : drives) drive_list.push_back(driveJson(drive));
  const Json per_voxel = found.known() > 0 ? Json(found.bytesPerKnownVoxel(bytes)) : Json();
  return Json{{"file", file.path()},
              {"program", info.program},
              {"frame", info.frame},
              {"resolution", info.resolution},
              {"prior", info.prior},
              {"class_table", info.classes->name()},
              {"bounds", boxJson(found.bounds(info.resolution))},
              {"voxels", {{"free", found.free}, {"occupied", found.occupied}, {"occluded", found.occluded}}},
              {"voxels_by_class", by_class},
              {"blocks", found.blocks},
              {"tiles", found.tiles},
              {"file_bytes", bytes},
              {"map_bytes", found.memory_bytes},
              {"file_bytes_per_known_voxel", per_voxel},
              {"drives", drive_list},
              {"journal", {{"scans", journal.scans}, {"bytes", journal.bytes}, {"drives", journal.drives}}}}
             .dump(2) +
         "\n";
}

}  // namespace bki_mapping
