/// @file Fractions for people.
#pragma once

#include <cmath>
#include <string>

#include "bki_mapping/core/named_parameter.h"

namespace bki_mapping {

/// A fraction as "12 %"; with three decimals near 0 and 100, to distinguish it from these.
inline std::string percentText(double fraction) {
  const double rounded =
      fraction > 0.99 || fraction < 0.01 ? std::round(1e5 * fraction) / 1e3 : std::round(100.0 * fraction);
  return numberText(rounded) + " %";
}

}  // namespace bki_mapping
