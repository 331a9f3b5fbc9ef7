#include "bki_mapping/ros/score_reader.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "bki_mapping/ros/point_field.h"

namespace bki_mapping::ros_shell {
namespace {

/// What scores and top_k have in common: from scores to shares.
class ShareReader : public LabelReader {
 public:
  explicit ShareReader(ScoreType type) : type_(type) {}

  void append(const std::uint8_t* point, CloudLabels& out) override {
    shares_.clear();
    collect(point, out);
    out.are_ids = true;
    out.soft.startPoint();
    std::sort(shares_.begin(), shares_.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
    if (type_ == ScoreType::kLogit) exponentiate();
    mergeEqual();
    float sum = 0.0f;
    for (const ClassShare& s : shares_) sum += s.share;
    const ClassShare* best = nullptr;
    for (ClassShare& s : shares_) {
      s.share /= sum;
      out.soft.add(s);
      if (!best || s.share > best->share) best = &s;
    }
    if (!best) out.countUnknown(kNoLabel);
    out.labels.push_back(best ? best->id : kNoLabel);
  }

 protected:
  /// Appends the classes of a point with their scores to shares_.
  virtual void collect(const std::uint8_t* point, CloudLabels& out) = 0;

  void add(ClassId id, double score) {
    if (std::isfinite(score)) shares_.push_back({id, static_cast<float>(score)});
  }

 private:
  void exponentiate() {
    float most = -INFINITY;
    for (const ClassShare& s : shares_) most = std::max(most, s.share);
    for (ClassShare& s : shares_) s.share = std::exp(s.share - most);
  }

  /// Leaves out what is not positive, and adds up several labels of one class.
  void mergeEqual() {
    std::size_t kept = 0;
    for (const ClassShare& s : shares_) {
      if (!(s.share > 0.0f)) continue;
      if (kept > 0 && shares_[kept - 1].id == s.id) {
        shares_[kept - 1].share += s.share;
      } else {
        shares_[kept++] = s;
      }
    }
    shares_.resize(kept);
  }

  ScoreType type_;
  std::vector<ClassShare> shares_;
};

/// One score a class.
class ScoresReader : public ShareReader {
 public:
  ScoresReader(const sensor_msgs::PointCloud2& cloud, const InputConfig& input, const ClassTable& classes)
      : ShareReader(input.score_type) {
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
  void collect(const std::uint8_t* point, CloudLabels&) override {
    for (const auto& [id, field] : fields_) add(id, field(point));
  }

  std::vector<std::pair<ClassId, FieldReader>> fields_;
};

/// The likeliest labels with their scores.
class TopKReader : public ShareReader {
 public:
  TopKReader(const sensor_msgs::PointCloud2& cloud, const InputConfig& input, const ClassTable& classes,
             LabelValues values)
      : ShareReader(input.score_type),
        labels_(readersOf(cloud, input.label_field)),
        scores_(readersOf(cloud, input.score_fields)),
        classes_(classes),
        values_(values) {
    if (labels_.empty() || labels_.size() != scores_.size()) {
      throw std::invalid_argument("label_field names " + std::to_string(labels_.size()) +
                                  " labels a point, score_fields " + std::to_string(scores_.size()) +
                                  " scores; top_k needs as many of each");
    }
  }

 private:
  void collect(const std::uint8_t* point, CloudLabels& out) override {
    for (std::size_t k = 0; k < labels_.size(); ++k) {
      const std::uint32_t label = labels_[k].label(point);
      if (const auto id = classes_.classOf(label, values_)) {
        add(*id, scores_[k](point));
      } else {
        out.countUnknown(label);
      }
    }
  }

  std::vector<FieldReader> labels_, scores_;
  const ClassTable& classes_;
  LabelValues values_;
};

}  // namespace

std::unique_ptr<LabelReader> makeScoreReader(const sensor_msgs::PointCloud2& cloud, const InputConfig& input,
                                             const ClassTable& classes, LabelValues label_values) {
  if (input.label_encoding == LabelEncoding::kScores) {
    return std::make_unique<ScoresReader>(cloud, input, classes);
  }
  return std::make_unique<TopKReader>(cloud, input, classes, label_values);
}

}  // namespace bki_mapping::ros_shell
