#include "evaluation/reliability.h"

#include <algorithm>
#include <cmath>

namespace bki_mapping {

void Reliability::add(double probability, std::size_t count, std::size_t right) {
  Bin& bin = bins_[static_cast<std::size_t>(10.0 * std::min(probability, 0.999999))];
  bin.count += count;
  bin.right += right;
  bin.probability += probability * static_cast<double>(count);
}

double Reliability::error() const {
  double error = 0.0, count = 0.0;
  for (const Bin& bin : bins_) {
    error += std::abs(static_cast<double>(bin.right) - bin.probability);
    count += static_cast<double>(bin.count);
  }
  return error / count;
}

}  // namespace bki_mapping
