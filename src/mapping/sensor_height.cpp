#include "mapping/sensor_height.h"

#include <algorithm>

namespace bki_mapping {

SensorHeight::SensorHeight(const ClassTable& classes) {
  for (const SemanticClass& c : classes.classes()) ground_[c.id] = c.ground;
}

double SensorHeight::in(const PointGroups& hits) {
  constexpr float kNear = 10.0f, kFar = 20.0f;
  constexpr std::size_t kFewest = 20;
  near_.clear();
  far_.clear();
  for (const MergedPoints* group : hits) {
    for (std::size_t i = 0; i < group->size(); ++i) {
      if (!ground_[group->labels[i]]) continue;
      const float squared = group->x[i] * group->x[i] + group->y[i] * group->y[i];
      if (squared <= kNear * kNear) near_.push_back(group->z[i]);
      if (squared <= kFar * kFar) far_.push_back(group->z[i]);
    }
  }
  std::vector<float>& heights = near_.size() >= kFewest ? near_ : far_;
  if (heights.size() < kFewest) return 0.0;
  const auto middle = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 2);
  std::nth_element(heights.begin(), middle, heights.end());
  return std::max(-static_cast<double>(*middle), 0.0);
}

}  // namespace bki_mapping
