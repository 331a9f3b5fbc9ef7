#include "io/voxel_pcl.h"

#include "io/little_endian.h"

namespace bki_mapping {
namespace {

using Field = pcl::PCLPointField;

/// Appends a field after the existing ones.
void addField(const char* name, std::uint8_t datatype, std::uint32_t size, pcl::PCLPointCloud2& cloud) {
  Field field;
  field.name = name;
  field.offset = cloud.point_step;
  field.datatype = datatype;
  field.count = 1;
  cloud.fields.push_back(field);
  cloud.point_step += size;
}

}  // namespace

pcl::PCLPointCloud2 toPcl(const std::vector<VoxelRecord>& voxels) {
  pcl::PCLPointCloud2 cloud;
  for (const char* name : {"x", "y", "z", "rgb"}) addField(name, Field::FLOAT32, 4, cloud);
  addField("label", Field::UINT16, 2, cloud);
  addField("state", Field::UINT8, 1, cloud);
  for (const char* name :
       {"probability", "occupancy", "class_probability", "variance", "entropy", "evidence"}) {
    addField(name, Field::FLOAT32, 4, cloud);
  }
  std::string bytes;
  bytes.reserve(voxels.size() * cloud.point_step);
  for (const VoxelRecord& v : voxels) {
    for (const float c : {v.x, v.y, v.z}) appendBytes(bytes, c);
    appendBytes(bytes, std::uint32_t{v.red} << 16 | std::uint32_t{v.green} << 8 | v.blue);
    appendBytes(bytes, v.label);
    appendBytes(bytes, v.state);
    for (const float f :
         {v.probability, v.occupancy, v.class_probability, v.variance, v.entropy, v.evidence}) {
      appendBytes(bytes, f);
    }
  }
  cloud.height = 1;
  cloud.width = static_cast<std::uint32_t>(voxels.size());
  cloud.row_step = cloud.point_step * cloud.width;
  cloud.is_dense = true;
  cloud.data.assign(bytes.begin(), bytes.end());
  return cloud;
}

}  // namespace bki_mapping
