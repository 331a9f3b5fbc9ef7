#include "ros/cloud_conversion.h"

#include <cstring>
#include <memory>
#include <optional>

namespace bki_mapping::ros_interface {

CloudContent readCloud(const sensor_msgs::PointCloud2& cloud, const InputConfig& input,
                       const ClassTable& classes, LabelValues label_values, const Eigen::Vector3d& sensor) {
  checkSizes(cloud);
  const FieldReader x(cloud, "x"), y(cloud, "y"), z(cloud, "z");
  const std::unique_ptr<LabelReader> labels = makeLabelReader(cloud, input, classes, label_values);
  std::optional<FieldReader> time;
  if (!input.time_field.empty()) time.emplace(cloud, input.time_field);
  CloudContent content;
  if (!(x.single() && y.single() && z.single())) content.origin = sensor;
  const std::size_t count = std::size_t{cloud.width} * cloud.height;
  const bool organised = input.clear_no_returns && cloud.height > 1 && cloud.width > 1;
  std::vector<Eigen::Vector3f> grid;
  std::vector<Answer> answers;  // of the grid
  std::vector<double> grid_times;
  content.points.reserve(count);
  content.labels.labels.reserve(count);
  if (organised) {
    grid.reserve(count);
    answers.reserve(count);
    if (time) grid_times.reserve(count);
  }
  for (std::size_t row = 0; row < cloud.height; ++row) {
    for (std::size_t column = 0; column < cloud.width; ++column) {
      const std::uint8_t* bytes = cloud.data.data() + row * cloud.row_step + column * cloud.point_step;
      const Eigen::Vector3d place(x(bytes), y(bytes), z(bytes));
      const Eigen::Vector3f point = (place - content.origin).cast<float>();
      const Answer answer = input.clear_no_returns ? answerOf(place, sensor) : Answer::kReturn;
      if (organised) {
        grid.push_back(point);
        answers.push_back(answer);
        if (time) grid_times.push_back((*time)(bytes));
      }
      if (answer == Answer::kReturn) {
        content.points.push_back(point);
        labels->append(bytes, content.labels);
        if (time) content.times.push_back((*time)(bytes));
      } else if (answer == Answer::kDirection) {
        content.no_returns.push_back(directionOf(point));
        if (time) content.no_return_times.push_back((*time)(bytes));
      } else if (!organised) {
        content.no_returns.push_back(Eigen::Vector3f::Zero());
        if (time) content.no_return_times.push_back(0.0);
        content.no_direction = NoDirection::kUnorganised;
      }
    }
  }
  if (organised) {
    const Holes holes =
        directionsOfHoles(grid, answers, cloud.width, (sensor - content.origin).cast<float>());
    content.no_direction = holes.unknown;
    content.no_returns.insert(content.no_returns.end(), holes.directions.begin(), holes.directions.end());
    for (const std::size_t place : holes.same_firing) {
      if (time) content.no_return_times.push_back(grid_times[place]);
    }
  }
  return content;
}

sensor_msgs::PointCloud2 makeCloud(const std::vector<Eigen::Vector3f>& points,
                                   const std::vector<float>& intensities,
                                   const std::vector<std::uint32_t>& labels) {
  sensor_msgs::PointCloud2 cloud;
  const char* names[] = {"x", "y", "z", "intensity", "label"};
  for (std::uint32_t f = 0; f < 5; ++f) {
    sensor_msgs::PointField field;
    field.name = names[f];
    field.offset = 4 * f;
    field.datatype = f < 4 ? sensor_msgs::PointField::FLOAT32 : sensor_msgs::PointField::UINT32;
    field.count = 1;
    cloud.fields.push_back(field);
  }
  cloud.height = 1;
  cloud.width = static_cast<std::uint32_t>(points.size());
  cloud.point_step = 20;
  cloud.row_step = cloud.point_step * cloud.width;
  cloud.is_bigendian = hostIsBigEndian();
  cloud.is_dense = false;
  cloud.data.resize(std::size_t{cloud.row_step});
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::uint8_t* out = cloud.data.data() + 20 * i;
    std::memcpy(out, points[i].data(), 12);
    std::memcpy(out + 12, &intensities[i], 4);
    std::memcpy(out + 16, &labels[i], 4);
  }
  return cloud;
}

}  // namespace bki_mapping::ros_interface
