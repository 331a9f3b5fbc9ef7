/// @file Packs scans of a journal into bytes, without loss.
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

#include "journal/sensor_scan.h"

namespace bki_mapping {

/// Bytes that are no packed scan: one clause that says what is wrong.
class ScanDamaged : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Packs a scan: what is packed is how far each point is from where the one before in its row lets it be
/// expected, 1.1 bytes a point of a lidar at a quantum of 1 cm.
std::string packScan(const SensorScan& scan);

/// Unpacks a scan. Takes memory in proportion to the bytes, whatever they say.
/// @throws ScanDamaged.
SensorScan unpackScan(std::string_view bytes);

}  // namespace bki_mapping
