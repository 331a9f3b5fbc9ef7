#include "store/evidence_steps.h"

#include <algorithm>

#include "bki_mapping/map/evidence_rounding.h"

namespace bki_mapping {
namespace {

/// Steps fit if at least one value in so many is a sum of them alone. Of other values, one in a hundred or
/// fewer is, by chance.
constexpr std::size_t kFittingOneOf = 8;
/// So that steps are found faster, only one value in so many is looked at.
constexpr std::size_t kSampledOneOf = 5;

std::uint32_t stepOf(double evidence) {
  return static_cast<std::uint32_t>(unitsOf(evidence));
}

struct Multiples {
  std::uint32_t n, m, rest;
};

Multiples multiplesOf(std::uint32_t value, const EvidenceSteps& steps) {
  Multiples of{0, 0, value};
  if (steps.a > 0) {
    of.n = of.rest / steps.a;
    of.rest %= steps.a;
  }
  if (steps.b > 0) {
    of.m = of.rest / steps.b;
    of.rest %= steps.b;
  }
  return of;
}

/// Writes the bytes of numbers from a bit on. @param differs whether to write each as the difference from the
/// one before. @param some bits that any number has.
void splitByte(std::size_t bit, bool differs, std::uint32_t some, const EvidenceSections::Values& numbers,
               std::string& section) {
  section.clear();
  if ((some >> bit & 0xff) == 0) return;
  section.resize(numbers.size());
  char* const to = section.data();
  for (std::size_t i = 0; i < numbers.size(); ++i) to[i] = static_cast<char>(numbers[i] >> bit);
  for (std::size_t i = numbers.size() - 1; differs && i > 0; --i)
    to[i] = static_cast<char>(to[i] - to[i - 1]);
}

/// Calls visit(value) for the values of a kind.
template <typename Values, typename Visit>
void forEachOf(EvidenceSections::Kind kind, const EvidenceSections::Planes& planes, Values& values,
               Visit&& visit) {
  auto* value = values.data();
  for (const EvidenceSections::Plane& plane : planes) {
    if (plane.kind == kind) std::for_each(value, value + plane.values, visit);
    value += plane.values;
  }
}

}  // namespace

std::size_t EvidenceSections::count(const Planes& planes, Kind kind) {
  std::size_t count = 0;
  for (const Plane& plane : planes) count += plane.kind == kind ? plane.values : 0;
  return count;
}

EvidenceSections::StepsOfKinds EvidenceSections::stepsOf(const RulesConfig& rules) {
  return {{{stepOf(rules.emptiness()), stepOf(RulesConfig::kCrossing)}, {stepOf(RulesConfig::kHit), 0}}};
}

EvidenceSections::StepsOfKinds EvidenceSections::fittingOf(StepsOfKinds steps, const Planes& planes,
                                                           const Values& values) {
  for (const Kind kind : {kFree, kOther}) {
    std::size_t sampled = 0, fitting = 0, i = 0;
    forEachOf(kind, planes, values, [&](std::uint32_t value) {
      if (i++ % kSampledOneOf != 0) return;
      ++sampled;
      fitting += multiplesOf(value, steps[kind]).rest == 0;
    });
    if (fitting * kFittingOneOf < sampled) steps[kind] = {};
  }
  return steps;
}

void EvidenceSections::split(const Planes& planes, const Values& values, const StepsOfKinds& steps,
                             std::string* sections) {
  std::array<Values, 3> numbers;  // n, m and the rest
  for (const Kind kind : {kFree, kOther}) {
    for (Values& each : numbers) each.resize(count(planes, kind));
    std::array<std::uint32_t, 3> some{};
    std::size_t i = 0;
    forEachOf(kind, planes, values, [&](std::uint32_t value) {
      const Multiples of = multiplesOf(value, steps[kind]);
      numbers[0][i] = of.n;
      numbers[1][i] = of.m;
      numbers[2][i++] = of.rest;
      some = {some[0] | of.n, some[1] | of.m, some[2] | of.rest};
    });
    for (std::size_t s = 0; s < kOfKind; ++s) {
      const std::size_t number = s / 4;
      splitByte(8 * (s % 4), number < 2, some[number], numbers[number], sections[kind * kOfKind + s]);
    }
  }
}

void EvidenceSections::add(std::size_t section, const std::string& bytes, const Planes& planes,
                           const StepsOfKinds& steps, Values& values) {
  const Kind kind = kindOf(section);
  const std::size_t number = section % kOfKind / 4;
  const std::uint32_t units[] = {steps[kind].a, steps[kind].b, 1};
  const std::uint32_t unit = units[number] << 8 * (section % 4);
  const char* next = bytes.data();
  unsigned char byte = 0;
  forEachOf(kind, planes, values, [&](std::uint32_t& value) {
    byte = static_cast<unsigned char>((number < 2 ? byte : 0) + static_cast<unsigned char>(*next++));
    value += unit * byte;
  });
}

}  // namespace bki_mapping
