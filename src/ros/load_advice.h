/// @file What to change when mapping cannot keep up.
#pragma once

#include <string>

#include "bki_mapping/mapping/mapper_config.h"

namespace bki_mapping::ros_shell {

/// How one integration compares with the time between clouds.
/// @param integration_ms median time of an integration [ms]. @param received_hz clouds a second [Hz].
/// @return their product: above 1, clouds must be dropped; 0 if either is not known.
double loadOf(double integration_ms, double received_hz);

/// One sentence that says how far mapping is behind and which settings would help, each with an estimate of
/// the time then, from measurements (docs/performance.md, docs/tuning.md). "" while the load is at most 1.
std::string loadAdvice(const MapperConfig& config, double integration_ms, double received_hz);

}  // namespace bki_mapping::ros_shell
