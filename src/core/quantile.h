/// @file Quantiles of a few values.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace bki_mapping {

/// The p-quantile by nearest rank: the smallest value that at least a fraction `p` of the values does not
/// exceed.
/// @param p in [0, 1]. @return 0 if there are no values.
inline double quantile(std::vector<double> values, double p) {
  if (values.empty()) return 0.0;
  const auto rank = static_cast<std::ptrdiff_t>(std::ceil(p * static_cast<double>(values.size())));
  const auto count = static_cast<std::ptrdiff_t>(values.size());
  const auto nth = values.begin() + std::clamp<std::ptrdiff_t>(rank, 1, count) - 1;
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

}  // namespace bki_mapping
