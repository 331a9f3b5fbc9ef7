/// @file The number pi, which the standard library has only since C++20.
#pragma once

namespace bki_mapping {

constexpr double kPi = 3.14159265358979323846;

}  // namespace bki_mapping
