#include "bki_mapping/query/queries.h"

#include "queries.h"
#include "requests.h"

namespace bki_mapping::ros_interface {

void query(const QueriedMap& map, const QueryPoints::Request& asked, QueryPoints::Response& answer) {
  const std::size_t count = asked.points.size();
  checkBatch(count, QueryPoints::Request::MOST_POINTS, "points");
  std::vector<VoxelState> states(count);
  std::vector<ClassId> labels(count);
  for (auto* field : {&answer.occupancy, &answer.class_probability, &answer.probability, &answer.variance}) {
    field->resize(count);
  }
  readPoints(map.states, toVectors(asked.points),
             {states.data(), labels.data(), answer.occupancy.data(), answer.class_probability.data(),
              answer.probability.data(), answer.variance.data()});
  answer.header = map.header;
  answer.state.reserve(count);
  answer.class_name.reserve(count);
  for (std::size_t n = 0; n < count; ++n) {
    answer.state.push_back(static_cast<std::int8_t>(states[n]));
    answer.class_name.push_back(map.classes.nameOf(labels[n]));
  }
}

}  // namespace bki_mapping::ros_interface
