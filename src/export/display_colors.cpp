#include "export/display_colors.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace bki_mapping {
namespace {

constexpr Color kUnlabelled = {140, 140, 140};
/// Colours closer than this in CIE L*a*b* are hard to tell apart where voxels are small and shaded.
constexpr double kLeastDifference = 15.0;
/// A replacement that differs at least so much from all other colours is taken at once.
constexpr double kClearDifference = 30.0;
/// What a class can take if its own colour is too close to another's; bright ones first.
constexpr std::array<Color, 12> kSpare = {{{0, 215, 195},
                                           {190, 150, 255},
                                           {255, 225, 60},
                                           {180, 255, 0},
                                           {0, 255, 140},
                                           {255, 150, 190},
                                           {255, 170, 110},
                                           {70, 70, 255},
                                           {120, 60, 20},
                                           {0, 110, 90},
                                           {110, 0, 110},
                                           {20, 60, 120}}};

/// CIE L*a*b* of an sRGB colour under D65 (IEC 61966-2-1, CIE 15), in which distances are about what people
/// see.
Eigen::Vector3d labOf(const Color& color) {
  Eigen::Vector3d linear;
  for (std::size_t i = 0; i < color.size(); ++i) {
    const double value = color[i] / 255.0;
    linear[static_cast<Eigen::Index>(i)] =
        value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
  }
  const Eigen::Vector3d x(0.4124, 0.3576, 0.1805), y(0.2126, 0.7152, 0.0722), z(0.0193, 0.1192, 0.9505);
  const auto root = [](double t) { return t > 0.008856 ? std::cbrt(t) : 7.787 * t + 16.0 / 116.0; };
  const double fx = root(x.dot(linear) / 0.9505), fy = root(y.dot(linear)), fz = root(z.dot(linear) / 1.089);
  return {116.0 * fy - 16.0, 500.0 * (fx - fy), 200.0 * (fy - fz)};
}

/// The distance of a colour to the nearest of others.
double differenceFrom(const std::vector<Color>& others, const Color& color) {
  double least = std::numeric_limits<double>::infinity();
  for (const Color& other : others) least = std::min(least, (labOf(other) - labOf(color)).norm());
  return least;
}

Color spareBeside(const std::vector<Color>& others) {
  const auto difference = [&](const Color& color) { return differenceFrom(others, color); };
  const auto clear = std::find_if(kSpare.begin(), kSpare.end(),
                                  [&](const Color& color) { return difference(color) >= kClearDifference; });
  if (clear != kSpare.end()) return *clear;
  return *std::max_element(kSpare.begin(), kSpare.end(),
                           [&](const Color& a, const Color& b) { return difference(a) < difference(b); });
}

}  // namespace

ClassTable displayTable(const ClassTable& classes) {
  std::vector<SemanticClass> shown = classes.classes();
  std::vector<Color> given = {kFreeColor, kUnlabelled};
  std::vector<SemanticClass*> waiting;
  for (SemanticClass& c : shown) {
    if (c.unlabelled) {
      c.color = kUnlabelled;
    } else if (differenceFrom(given, c.color) < kLeastDifference) {
      waiting.push_back(&c);
    } else {
      given.push_back(c.color);
    }
  }
  for (SemanticClass* c : waiting) {
    c->color = spareBeside(given);
    given.push_back(c->color);
  }
  return ClassTable(classes.name(), std::move(shown));
}

}  // namespace bki_mapping
