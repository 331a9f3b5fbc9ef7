#include "bki_mapping/store/map_file.h"

#include <algorithm>
#include <limits>
#include <sstream>

#include "bki_mapping/core/named_parameter.h"

namespace bki_mapping {
namespace {

std::string textOf(const std::string& value, const std::string&) {
  return value;
}
std::string textOf(int value, int) {
  return std::to_string(value);
}
std::string textOf(std::size_t value, std::size_t) {
  return std::to_string(value);
}
/// With all digits only where two values differ in no others.
std::string textOf(double value, double other) {
  if (numberText(value) != numberText(other)) return numberText(value);
  std::ostringstream text;
  text.precision(std::numeric_limits<double>::max_digits10);
  text << value;
  return text.str();
}

template <typename T>
void checkSame(const std::string& what, const std::string& name, const T& value,
               const std::string& other_name, const T& other) {
  if (value == other) return;
  throw std::invalid_argument(what + " of " + name + " is " + textOf(value, other) + " and that of " +
                              other_name + " is " + textOf(other, value) +
                              "; maps can only be added if they agree");
}

/// The names of classes by id, since the order in the table does not matter.
std::vector<std::string> classNames(const ClassTable& table) {
  std::vector<std::pair<ClassId, std::string>> sorted;
  for (const SemanticClass& c : table.classes()) sorted.emplace_back(c.id, c.name);
  std::sort(sorted.begin(), sorted.end());
  std::vector<std::string> names;
  for (const auto& [id, name] : sorted) names.push_back(std::to_string(id) + " '" + name + "'");
  return names;
}

}  // namespace

SemanticMap MapInfo::emptyMap() const {
  return {GridGeometry(resolution), prior, classes->size()};
}

bool DriveRecord::operator==(const DriveRecord& other) const {
  const bool same_bounds = bounds.isEmpty()
                               ? other.bounds.isEmpty()
                               : bounds.min() == other.bounds.min() && bounds.max() == other.bounds.max();
  return id == other.id && name == other.name && part == other.part && scans == other.scans &&
         first_stamp == other.first_stamp && last_stamp == other.last_stamp && same_bounds;
}

void DriveRecord::addScan(std::uint64_t stamp, const GridGeometry& geometry,
                          const std::vector<GridIndex>& touched) {
  first_stamp = scans == 0 ? stamp : std::min(first_stamp, stamp);
  last_stamp = std::max(last_stamp, stamp);
  ++scans;
  addTouched(geometry, touched);
}

void DriveRecord::addTouched(const GridGeometry& geometry, const std::vector<GridIndex>& touched) {
  for (const GridIndex& block : touched) {
    const Eigen::Vector3d low = geometry.blockOrigin({block});
    bounds.extend(low);
    bounds.extend(low + Eigen::Vector3d::Constant(geometry.blockSize()));
  }
}

void checkSameGrid(const std::string& name, const MapInfo& info, const std::string& other_name,
                   const MapInfo& other) {
  checkSame("the resolution", name, info.resolution, other_name, other.resolution);
  checkSame("the unit exponent", name, info.unit_exponent, other_name, other.unit_exponent);
  checkSame("the prior", name, info.prior, other_name, other.prior);
  const std::vector<std::string> names = classNames(*info.classes), others = classNames(*other.classes);
  checkSame("the number of classes", name, names.size(), other_name, others.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    checkSame("class " + std::to_string(i), name, names[i], other_name, others[i]);
  }
}

}  // namespace bki_mapping
