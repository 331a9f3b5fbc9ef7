/// @file Advice for when mapping cannot keep up with the clouds.
#pragma once

#include <string>

#include "bki_mapping/mapping/mapper_config.h"

namespace bki_mapping::ros_interface {

/// The load: integration time divided by the time between clouds. Above 1, clouds must be dropped.
/// @param integration_ms median time of an integration [ms]. @param received_hz rate of clouds [Hz].
/// @return 0 if either is unknown (0).
double loadOf(double integration_ms, double received_hz);

/// One sentence: how much too slow mapping is, and which settings would help, each with the integration time
/// estimated from the measurements in docs/performance.md and docs/tuning.md. "" if the load is at most 1.
std::string loadAdvice(const MapperConfig& config, double integration_ms, double received_hz);

}  // namespace bki_mapping::ros_interface
