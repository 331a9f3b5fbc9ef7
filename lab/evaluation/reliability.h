/// @file How often predictions with a probability are correct: expected calibration error (ECE).
#pragma once

#include <array>
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
  void add(double probability, std::size_t count, std::size_t right);
  const std::array<Bin, 10>& bins() const { return bins_; }
  /// Expected calibration error: the mean, over all predictions, of |accuracy - mean probability| in their
  /// bin. NaN without predictions.
  double error() const;

 private:
  std::array<Bin, 10> bins_;
};

}  // namespace bki_mapping
