/// @file How often predictions with a probability are correct: expected calibration error (ECE).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace bki_mapping {

/// Reliability diagram: predicted probabilities in ten bins of equal width, and how often the prediction was
/// correct.
class Reliability {
 public:
  struct Bin {
    std::size_t count = 0, right = 0;
    double probability = 0.0;  ///< sum of the predicted probabilities
  };

  /// Adds `count` predictions of equal probability. @param right how many of them are correct.
  void add(double probability, std::size_t count, std::size_t right) {
    Bin& bin = bins_[static_cast<std::size_t>(10.0 * std::min(probability, 0.999999))];
    bin.count += count;
    bin.right += right;
    bin.probability += probability * static_cast<double>(count);
  }
  const std::array<Bin, 10>& bins() const { return bins_; }
  /// Expected calibration error: the mean, over all predictions, of |accuracy - mean probability| in their
  /// bin. NaN without predictions.
  double error() const {
    double error = 0.0, count = 0.0;
    for (const Bin& bin : bins_) {
      error += std::abs(static_cast<double>(bin.right) - bin.probability);
      count += static_cast<double>(bin.count);
    }
    return error / count;
  }

 private:
  std::array<Bin, 10> bins_;
};

}  // namespace bki_mapping
