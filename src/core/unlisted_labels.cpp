#include "core/unlisted_labels.h"

namespace bki_mapping {

void UnlistedLabels::add(std::int64_t label, std::size_t points) {
  const auto known = counts_.find(label);
  if (known != counts_.end()) {
    known->second += points;
  } else if (counts_.size() < kMost) {
    counts_.emplace(label, points);
  } else {
    others_ += points;
  }
}

UnlistedLabels& UnlistedLabels::operator+=(const UnlistedLabels& other) {
  for (const auto& [label, points] : other.counts_) add(label, points);
  missing_ += other.missing_;
  others_ += other.others_;
  rounded_ = rounded_ || other.rounded_;
  return *this;
}

UnlistedLabels unlistedLabels(Span<const std::uint32_t> labels, const ClassTable& classes,
                              LabelValues values) {
  UnlistedLabels unknown;
  std::size_t run = 0;  // neighbouring points mostly have the same label
  for (std::size_t i = 0; i < labels.size(); i += run) {
    for (run = 1; i + run < labels.size() && labels[i + run] == labels[i];) ++run;
    if (classes.classOf(labels[i], values)) continue;
    unknown.add(labels[i] == kNoLabel ? -1 : std::int64_t{labels[i]}, run);
  }
  return unknown;
}

}  // namespace bki_mapping
