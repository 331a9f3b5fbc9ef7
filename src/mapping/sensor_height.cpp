#include "mapping/sensor_height.h"

#include <algorithm>
#include <vector>

namespace bki_mapping {

double heightAboveGround(const PointGroups& hits, const ClassTable& classes) {
  constexpr float kNear = 10.0f, kFar = 20.0f;
  constexpr std::size_t kFewest = 20;
  ClassSet ground;
  for (const SemanticClass& c : classes.classes()) ground[c.id] = c.ground;
  std::vector<float> near, far;
  for (const MergedPoints* group : hits) {
    for (std::size_t i = 0; i < group->size(); ++i) {
      if (!ground[group->labels[i]]) continue;
      const float squared = group->x[i] * group->x[i] + group->y[i] * group->y[i];
      if (squared <= kNear * kNear) near.push_back(group->z[i]);
      if (squared <= kFar * kFar) far.push_back(group->z[i]);
    }
  }
  std::vector<float>& heights = near.size() >= kFewest ? near : far;
  if (heights.size() < kFewest) return 0.0;
  const auto middle = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 2);
  std::nth_element(heights.begin(), middle, heights.end());
  return std::max(-static_cast<double>(*middle), 0.0);
}

}  // namespace bki_mapping
