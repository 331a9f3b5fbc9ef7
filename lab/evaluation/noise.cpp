#include "evaluation/noise.h"

#include <algorithm>
#include <map>
#include <stdexcept>
#include <tuple>

#include "parallel/counter_random.h"

namespace bki_mapping {
namespace {

constexpr double kObjectEdge = 2.0, kBorderEdge = 0.5;  ///< of the cubes [m]
constexpr double kFarDistance = 20.0;                   ///< where the rate is the one asked for [m]

using Cube = std::tuple<int, int, int>;

Cube cubeAt(const Scan& scan, std::size_t i, double edge) {
  const Eigen::Array3d cube = ((scan.origin + scan.points[i].cast<double>()).array() / edge).floor();
  return {static_cast<int>(cube.x()), static_cast<int>(cube.y()), static_cast<int>(cube.z())};
}

bool areSimilar(const SemanticClass& a, const SemanticClass& b) {
  return a.dynamic == b.dynamic && a.ground == b.ground;
}

/// Draws wrong labels for the points of one scan.
class Errors {
 public:
  Errors(const Scan& scan, const ClassTable& classes, const LabelNoise& noise)
      : scan_(scan), classes_(classes), noise_(noise) {
    for (const SemanticClass& c : classes.classes()) {
      if (!c.unlabelled && (scan.labels_are_ids || !c.raw.empty())) known_.push_back(&c);
    }
    if (noise.errors != LabelErrors::kBorders && noise.errors != LabelErrors::kNetwork) return;
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      if (classOf(i)) labels_in_[cubeAt(scan, i, kBorderEdge)].push_back(scan.labels[i]);
    }
  }

  /// The label that the mapper is given for a point.
  std::uint32_t labelOf(std::size_t i) const {
    const double rate = noise_.rate;
    switch (noise_.errors) {
      case LabelErrors::kEven:
        return random(i, 0) < rate ? otherLabel(i, random(i, 1), false) : scan_.labels[i];
      case LabelErrors::kSimilar:
        return random(i, 0) < rate ? otherLabel(i, random(i, 1), true) : scan_.labels[i];
      case LabelErrors::kObjects:
        return labelOfObject(i, rate);
      case LabelErrors::kBorders:
        return labelAtBorder(i, rate);
      case LabelErrors::kFar:
        return labelFarAway(i, rate);
      case LabelErrors::kNetwork: {
        const std::uint32_t of_object = labelOfObject(i, 0.5 * rate);
        if (of_object != scan_.labels[i]) return of_object;
        const std::uint32_t at_border = labelAtBorder(i, rate);
        return at_border != scan_.labels[i] ? at_border : labelFarAway(i, 0.5 * rate);
      }
    }
    return scan_.labels[i];
  }

 private:
  /// The class of a point; nullptr if its label is not in the table.
  const SemanticClass* classOf(std::size_t i) const {
    const auto id = classes_.classOf(scan_.labels[i], labelValues(scan_));
    return id ? classes_.find(*id) : nullptr;
  }
  double random(std::size_t i, std::uint64_t draw) const {
    return counterRandom(noise_.seed, scan_.stamp, i, draw);
  }

  /// @param pick chooses among the other classes; uniform on [0, 1).
  std::uint32_t otherLabel(std::size_t i, double pick, bool similar) const {
    const SemanticClass* own = classOf(i);
    std::vector<const SemanticClass*> others;
    for (const SemanticClass* c : known_) {
      if (c != own && (!similar || !own || areSimilar(*c, *own))) others.push_back(c);
    }
    if (others.empty()) return scan_.labels[i];
    const SemanticClass& chosen =
        *others[static_cast<std::size_t>(pick * static_cast<double>(others.size()))];
    return scan_.labels_are_ids ? chosen.id : chosen.raw.front();
  }

  std::uint32_t labelFarAway(std::size_t i, double rate_at_far_distance) const {
    const double rate = rate_at_far_distance * static_cast<double>(scan_.points[i].norm()) / kFarDistance;
    return random(i, 2) < rate ? otherLabel(i, random(i, 3), true) : scan_.labels[i];
  }

  std::uint32_t labelOfObject(std::size_t i, double rate) const {
    const SemanticClass* own = classOf(i);
    const auto [x, y, z] = cubeAt(scan_, i, kObjectEdge);
    std::uint64_t key = own ? own->id : kFreeClass;
    for (const int coordinate : {x, y, z}) key = mixBits(key ^ static_cast<std::uint32_t>(coordinate));
    const std::uint64_t when = scan_.stamp / static_cast<std::uint64_t>(1e9 * noise_.object_seconds);
    if (counterRandom(noise_.seed, when, key, 0) >= rate) return scan_.labels[i];
    return otherLabel(i, counterRandom(noise_.seed, when, key, 1), true);
  }

  std::uint32_t labelAtBorder(std::size_t i, double rate) const {
    const SemanticClass* own = classOf(i);
    if (!own || random(i, 0) >= rate) return scan_.labels[i];
    std::vector<std::uint32_t> others;
    for (const std::uint32_t label : labels_in_.at(cubeAt(scan_, i, kBorderEdge))) {
      if (classes_.classOf(label, labelValues(scan_)) != own->id) others.push_back(label);
    }
    if (others.empty()) return scan_.labels[i];
    return others[static_cast<std::size_t>(random(i, 1) * static_cast<double>(others.size()))];
  }

  const Scan& scan_;
  const ClassTable& classes_;
  const LabelNoise& noise_;
  std::vector<const SemanticClass*> known_;
  std::map<Cube, std::vector<std::uint32_t>> labels_in_;
};

}  // namespace

LabelErrors labelErrorsNamed(const std::string& name) {
  static const std::map<std::string, LabelErrors> kNamed = {
      {"even", LabelErrors::kEven},       {"similar", LabelErrors::kSimilar},
      {"objects", LabelErrors::kObjects}, {"borders", LabelErrors::kBorders},
      {"far", LabelErrors::kFar},         {"network", LabelErrors::kNetwork}};
  const auto found = kNamed.find(name);
  if (found != kNamed.end()) return found->second;
  throw std::invalid_argument("there are no label errors " + name +
                              "; known: even, similar, objects, borders, far, network");
}

std::vector<std::uint32_t> withLabelNoise(const Scan& scan, const ClassTable& classes,
                                          const LabelNoise& noise) {
  std::vector<std::uint32_t> labels = scan.labels;
  if (noise.rate <= 0.0) return labels;
  const Errors errors(scan, classes, noise);
  for (std::size_t i = 0; i < labels.size(); ++i) labels[i] = errors.labelOf(i);
  return labels;
}

Eigen::Isometry3d PoseNoise::error() const {
  const auto normal = [&](std::uint64_t axis) { return counterNormal(seed_, count_, axis); };
  const Eigen::Vector3d turn = angle_ * Eigen::Vector3d(normal(3), normal(4), normal(5));
  Eigen::Isometry3d error = Eigen::Isometry3d::Identity();
  error.translation() = position_ * Eigen::Vector3d(normal(0), normal(1), normal(2));
  if (!turn.isZero()) error.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
  return error;
}

Eigen::Isometry3d PoseNoise::next(const Eigen::Isometry3d& T_map_sensor) {
  Eigen::Isometry3d noisy = T_map_sensor * error();
  if (kind_ == Kind::kDrift) {
    noisy = count_ == 0 ? T_map_sensor : last_noisy_ * (last_true_.inverse() * T_map_sensor) * error();
  }
  ++count_;
  last_true_ = T_map_sensor;
  last_noisy_ = noisy;
  return noisy;
}

}  // namespace bki_mapping
