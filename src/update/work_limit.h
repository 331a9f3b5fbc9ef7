/// @file How large a scan may be.
#pragma once

#include <cstddef>
#include <stdexcept>

namespace bki_mapping {

/// A scan is larger than its limits: thrown before memory is taken for it, and turned into a sentence where
/// the settings are known (SemanticMapper).
class TooMuchWork : public std::exception {
 public:
  enum class What { kBlocks, kSamples, kBytes };

  /// @param estimate of what the whole scan would take: blocks, samples or bytes of the map.
  TooMuchWork(What what, double estimate) : what_(what), estimate_(estimate) {}
  const char* what() const noexcept override { return "a scan is larger than its limits"; }
  What of() const { return what_; }
  double estimate() const { return estimate_; }

 private:
  What what_;
  double estimate_;
};

/// Refuses more blocks than a limit. @param blocks that are named already. @param share of the scan that
/// named them, for an estimate of the whole.
inline void limitBlocks(std::size_t blocks, std::size_t most, double share = 1.0) {
  if (blocks > most) throw TooMuchWork(TooMuchWork::What::kBlocks, static_cast<double>(blocks) / share);
}

}  // namespace bki_mapping
