#include "ros/label_reader.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace bki_mapping::ros_interface {
namespace {

/// Common part of scores and top_k: normalises scores to a soft label.
class SoftLabelReader : public LabelReader {
 public:
  explicit SoftLabelReader(ScoreType type) : type_(type) {}

  void append(const std::uint8_t* point, CloudLabels& out) override {
    scores_.clear();
    usable_ = true;
    const bool any_known = collect(point, out);
    out.are_ids = true;
    out.soft.startPoint();
    if (type_ == ScoreType::kLogit) exponentiate();
    const Score* best = nullptr;
    if (usable_) best = appendProbabilities(out.soft);
    if (!best && any_known) out.unknown.addMissing();
    out.labels.push_back(best ? best->id : kNoLabel);
  }

 protected:
  /// Passes the classes of a point and their scores to add(). @return false if no label of the point is
  /// known; its labels are then counted as unknown.
  virtual bool collect(const std::uint8_t* point, CloudLabels& out) = 0;

  /// A score of minus infinity means an impossible class. NaN or infinity makes the point unusable: without
  /// this score, the probabilities of the other classes would be too large.
  void add(ClassId id, double score) {
    usable_ = usable_ && !std::isnan(score) && score != INFINITY;
    if (std::isfinite(score)) scores_.push_back({id, score});
  }

 private:
  struct Score {
    ClassId id;
    double value;
  };

  void exponentiate() {
    double most = -INFINITY;
    for (const Score& s : scores_) most = std::max(most, s.value);
    for (Score& s : scores_) s.value = std::exp(s.value - most);
  }

  /// Drops scores that are not positive, and sums those of the same class. Scores are first divided by the
  /// largest, so that the sums do not overflow.
  void mergeEqual() {
    double most = 0.0;
    for (const Score& s : scores_) most = std::max(most, s.value);
    std::sort(scores_.begin(), scores_.end(), [](const Score& a, const Score& b) { return a.id < b.id; });
    std::size_t kept = 0;
    for (const Score& s : scores_) {
      if (!(s.value > 0.0)) continue;
      if (kept > 0 && scores_[kept - 1].id == s.id) {
        scores_[kept - 1].value += s.value / most;
      } else {
        scores_[kept++] = {s.id, s.value / most};
      }
    }
    scores_.resize(kept);
  }

  /// @return the most probable class; nullptr if there is none.
  const Score* appendProbabilities(SoftLabels& soft) {
    mergeEqual();
    double sum = 0.0;
    for (const Score& s : scores_) sum += s.value;
    const Score* best = nullptr;
    for (const Score& s : scores_) {
      const auto probability = static_cast<float>(s.value / sum);
      if (probability > 0.0f) soft.add({s.id, probability});  // it may underflow to 0
      if (!best || s.value > best->value) best = &s;
    }
    return best;
  }

  ScoreType type_;
  bool usable_ = true;
  std::vector<Score> scores_;
};

/// Reads one score per class.
class ScoresReader : public SoftLabelReader {
 public:
  ScoresReader(const sensor_msgs::PointCloud2& cloud, const InputConfig& input, const ClassTable& classes)
      : SoftLabelReader(input.score_type) {
    const auto parts = splitList(input.score_fields);
    if (parts.size() == 1 && parts[0].find('=') == std::string::npos) {
      const std::vector<FieldReader> fields = readersOf(cloud, parts[0]);
      if (fields.size() != classes.size()) {
        throw std::invalid_argument("field '" + parts[0] + "' of the cloud has " +
                                    std::to_string(fields.size()) + " components, but class table '" +
                                    classes.name() + "' has " + std::to_string(classes.size()) + " classes");
      }
      for (std::size_t c = 0; c < fields.size(); ++c) {
        fields_.emplace_back(classes.classes()[c].id, fields[c]);
      }
      return;
    }
    for (const std::string& part : parts) {
      const std::size_t equal = part.find('=');
      const std::string name = part.substr(0, equal);
      const auto found = std::find_if(classes.classes().begin(), classes.classes().end(),
                                      [&](const SemanticClass& c) { return c.name == name; });
      if (equal == std::string::npos || found == classes.classes().end()) {
        throw std::invalid_argument("score_fields has '" + part +
                                    "', which is not CLASS=FIELD with a class of '" + classes.name() + "'");
      }
      fields_.emplace_back(found->id, FieldReader(cloud, part.substr(equal + 1)));
    }
    if (fields_.empty())
      throw std::invalid_argument("label_encoding is scores, but score_fields names no field");
  }

 private:
  bool collect(const std::uint8_t* point, CloudLabels&) override {
    for (const auto& [id, field] : fields_) add(id, field(point));
    return true;
  }

  std::vector<std::pair<ClassId, FieldReader>> fields_;
};

/// Reads the most probable labels and their scores.
class TopKReader : public SoftLabelReader {
 public:
  TopKReader(const sensor_msgs::PointCloud2& cloud, const InputConfig& input, const ClassTable& classes,
             LabelValues values)
      : SoftLabelReader(input.score_type), scores_(readersOf(cloud, input.score_fields)) {
    for (const FieldReader& field : readersOf(cloud, input.label_field)) {
      labels_.emplace_back(field, classes, values);
    }
    if (labels_.empty() || labels_.size() != scores_.size()) {
      throw std::invalid_argument("label_field names " + std::to_string(labels_.size()) +
                                  " labels a point, score_fields " + std::to_string(scores_.size()) +
                                  " scores; top_k needs equal numbers of both");
    }
  }

 private:
  bool collect(const std::uint8_t* point, CloudLabels& out) override {
    bool any_known = false;
    for (std::size_t k = 0; k < labels_.size(); ++k) {
      const auto id = labels_[k].read(point, out.unknown).id;
      if (id) add(*id, scores_[k](point));
      any_known |= id.has_value();
    }
    return any_known;
  }

  std::vector<LabelField> labels_;
  std::vector<FieldReader> scores_;
};

}  // namespace

std::unique_ptr<LabelReader> makeScoreReader(const sensor_msgs::PointCloud2& cloud, const InputConfig& input,
                                             const ClassTable& classes, LabelValues label_values) {
  if (input.label_encoding == LabelEncoding::kScores) {
    return std::make_unique<ScoresReader>(cloud, input, classes);
  }
  return std::make_unique<TopKReader>(cloud, input, classes, label_values);
}

}  // namespace bki_mapping::ros_interface
