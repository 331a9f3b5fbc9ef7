/// @file The exception for a scan that exceeds its limits.
#pragma once

#include <cstddef>
#include <stdexcept>

namespace bki_mapping {

/// A scan exceeds its limits. Thrown before memory is allocated for it; SemanticMapper, which knows the
/// settings, turns it into a message with the remedy.
class TooMuchWork : public std::exception {
 public:
  enum class What { kBlocks, kSamples, kBytes };

  /// @param estimate of what the whole scan would need: blocks, samples or bytes of the map.
  TooMuchWork(What what, double estimate) : what_(what), estimate_(estimate) {}
  const char* what() const noexcept override { return "a scan is larger than its limits"; }
  What of() const { return what_; }
  double estimate() const { return estimate_; }

 private:
  What what_;
  double estimate_;
};

/// @throws TooMuchWork if there are more than `most` blocks. @param fraction of the scan that these blocks
/// come from; used to estimate the total.
inline void limitBlocks(std::size_t blocks, std::size_t most, double fraction = 1.0) {
  if (blocks > most) throw TooMuchWork(TooMuchWork::What::kBlocks, static_cast<double>(blocks) / fraction);
}

}  // namespace bki_mapping
