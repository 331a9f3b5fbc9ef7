/// @file How far from the sensor a random sample lies on its beam: Equation 5 in docs/method.md.
#pragma once

#include <cmath>

namespace bki_mapping {

/// Mode `uniform`: uniform along the beam [m]. @param u uniform on [0, 1). @param length of the beam [m].
inline double uniformDistance(double u, double length) {
  return u * length;
}
/// Mode `linear`: the density grows linearly with the distance, and so is the same all over a plane of beams
/// (Theorem 1 of Zhong and Peng).
inline double linearDistance(double u, double length) {
  return std::sqrt(u) * length;
}

}  // namespace bki_mapping
