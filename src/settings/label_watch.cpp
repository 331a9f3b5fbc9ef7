#include "settings/label_watch.h"

#include <algorithm>
#include <cstdio>
#include <stdexcept>
#include <utility>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/settings/yaml.h"
#include "core/counted.h"

namespace bki_mapping {
namespace {

using Encoding = LabelWatch::Encoding;

std::vector<ClassTable> loadKnownTables() {
  std::vector<ClassTable> tables;
  for (const std::string& name : classTableNames()) {
    try {
      tables.push_back(loadClassTable(name));
    } catch (const std::invalid_argument&) {  // a table that somebody has spoilt helps nobody
    }
  }
  return tables;
}

bool takesAny(const ClassTable& classes) {
  const auto& all = classes.classes();
  return std::any_of(all.begin(), all.end(), [](const SemanticClass& c) { return c.any_raw; });
}

bool hasColor(const ClassTable& classes, std::int64_t color) {
  const auto part = [&](int shift) { return static_cast<std::uint8_t>(color >> shift & 0xff); };
  const std::array<std::uint8_t, 3> wanted = {part(16), part(8), part(0)};
  const auto& all = classes.classes();
  return std::any_of(all.begin(), all.end(), [&](const SemanticClass& c) { return c.color == wanted; });
}

std::int64_t withRedAndBlueSwapped(std::int64_t color) {
  return (color & 0xff) << 16 | (color & 0xff00) | color >> 16;
}

/// Whether a table has a class for a label, of which only some bits count.
bool has(const ClassTable& classes, std::int64_t label, LabelValues values,
         std::uint32_t bits = ClassTable::kAllBits) {
  return label <= ClassTable::kAllBits &&
         classes.classOf(static_cast<std::uint32_t>(label) & bits, values).has_value();
}

/// Names of tables in which `fits` is true for all labels: "class table carla has", "class tables a, b have".
template <typename Fits>
std::string tablesWith(const std::vector<ClassTable>& known, const ClassTable& but, Fits&& fits) {
  std::vector<std::string> names;
  for (const ClassTable& table : known) {
    if (table.name() != but.name() && !takesAny(table) && fits(table)) names.push_back(table.name());
  }
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  if (names.empty()) return "";
  return names.size() == 1 ? "class table " + text + " has" : "class tables " + text + " have";
}

const char* const kSetClasses = "; set classes to ";

std::string itOrOne(const std::string& tables) {
  return tables.find(',') == std::string::npos ? "it" : "the right one";
}

std::string colorRemedy(const std::set<std::int64_t>& seen, const ClassTable& classes, Encoding encoding,
                        const std::vector<ClassTable>& known) {
  const auto all = [&](auto&& fits) { return std::all_of(seen.begin(), seen.end(), fits); };
  if (all([&](std::int64_t color) { return hasColor(classes, withRedAndBlueSwapped(color)); })) {
    return std::string("with red and blue exchanged, the table has them all; set label_encoding to ") +
           (encoding == Encoding::kRgb ? "bgr" : "rgb");
  }
  const std::string tables = tablesWith(known, classes, [&](const ClassTable& table) {
    return all([&](std::int64_t color) { return hasColor(table, color); });
  });
  if (!tables.empty()) return tables + " them all" + kSetClasses + itOrOne(tables);
  return "set classes to the table of these colours, or color_match to nearest if images were compressed or "
         "resized";
}

std::string numberRemedy(const std::set<std::int64_t>& seen, const ClassTable& classes, LabelValues values,
                         const std::vector<ClassTable>& known) {
  const auto all = [&](const ClassTable& table, LabelValues as, std::uint32_t bits) {
    return std::all_of(seen.begin(), seen.end(),
                       [&](std::int64_t label) { return has(table, label, as, bits); });
  };
  const bool raw = values == LabelValues::kRaw;
  const LabelValues other = raw ? LabelValues::kId : LabelValues::kRaw;
  const std::string others = raw ? "ids of the table" : "raw labels of the table";
  const std::string set_other = std::string("label_values to ") + (raw ? "id" : "raw");
  if (all(classes, other, ClassTable::kAllBits))
    return "all labels seen are " + others + "; set " + set_other;
  for (const auto& [bits, what] : {std::pair(0xffffu, "lower 16 bits"), std::pair(0xffu, "lower 8 bits")}) {
    if (classes.labelMask() != ClassTable::kAllBits) break;
    const std::string mask = bits == 0xffffu ? "0xFFFF" : "0xFF";
    if (all(classes, values, bits)) {
      return std::string("the table has the ") + what + " of all labels seen; set its label_mask to " + mask;
    }
    if (all(classes, other, bits)) {
      return std::string("the ") + what + " of all labels seen are " + others + "; set its label_mask to " +
             mask + ", and " + set_other;
    }
  }
  for (const LabelValues as : {LabelValues::kRaw, LabelValues::kId}) {
    const std::string tables = tablesWith(
        known, classes, [&](const ClassTable& table) { return all(table, as, ClassTable::kAllBits); });
    if (tables.empty()) continue;
    const std::string too = as == values             ? ""
                            : as == LabelValues::kId ? ", and label_values to id"
                                                     : ", and label_values to raw";
    return tables + " all labels seen" + (as == LabelValues::kId ? " as ids" : "") + kSetClasses +
           itOrOne(tables) + too;
  }
  return "";
}

/// What to do about labels for which no setting is right.
std::string lastRemedy(const UnlistedLabels& unlisted, const ClassTable& classes) {
  if (unlisted.rounded()) {
    return "publish labels as integers: a field of single precision holds whole numbers only up to 2^24";
  }
  const auto& counts = unlisted.counts();
  if (counts.empty()) return "check label_field, label_encoding and score_fields";
  const auto unlabelled = classes.unlabelled();
  if (counts.rbegin()->first == -1) {
    return "list -1 under raw of " +
           (unlabelled ? "its class '" + classes.nameOf(*unlabelled) + "'" : "one of its classes") +
           " if it stands for no label";
  }
  return std::string("list them in the table") + (unlabelled ? ", set unknown_labels to unlabelled," : "") +
         " or check that label_field holds labels";
}

std::string pointsText(std::size_t points) {
  return " (" + std::to_string(points) + (points == 1 ? " point)" : " points)");
}

}  // namespace

std::string labelRemedy(const std::set<std::int64_t>& seen, const ClassTable& classes, LabelValues values,
                        Encoding encoding, const std::vector<ClassTable>& known) {
  std::set<std::int64_t> numbers(seen.lower_bound(0), seen.end());  // no setting makes sense of negative ones
  if (numbers.empty()) return "";
  if (encoding != Encoding::kNumber) return colorRemedy(numbers, classes, encoding, known);
  return numberRemedy(numbers, classes, values, known);
}

bool LabelWatch::see(Span<const std::uint32_t> labels, const UnlistedLabels& unlisted) {
  const std::size_t before = seen_.size();
  for (const auto& [label, ignored] : unlisted.counts()) {
    if (seen_.size() < kMostSeen) seen_.insert(label);
  }
  for (std::size_t i = 0; i < labels.size() && seen_.size() < kMostSeen; ++i) {
    if (labels[i] != kNoLabel && (i == 0 || labels[i] != labels[i - 1])) seen_.insert(labels[i]);
  }
  return seen_.size() > before;
}

std::string LabelWatch::findRemedy(const ClassTable& classes, const UnlistedLabels& unlisted,
                                   LabelValues values, Encoding encoding) {
  if (!known_tables_) known_tables_ = loadKnownTables();
  const bool any_sound = !unlisted.counts().empty() && unlisted.counts().rbegin()->first >= 0;
  std::string remedy;
  if (any_sound && !unlisted.rounded())
    remedy = labelRemedy(seen_, classes, values, encoding, *known_tables_);
  return remedy.empty() ? lastRemedy(unlisted, classes) : remedy;
}

std::string LabelWatch::nameNew(const UnlistedLabels& unlisted, Encoding encoding) {
  std::vector<std::pair<std::size_t, std::int64_t>> fresh;
  for (const auto& [label, points] : unlisted.counts()) {
    if (named_.size() < kMostNamed && named_.insert(label).second) fresh.emplace_back(points, label);
  }
  std::sort(fresh.begin(), fresh.end(), [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first > b.first : a.second < b.second;
  });
  std::string text;
  const auto append = [&](const std::string& item) { text += (text.empty() ? "" : ", ") + item; };
  for (std::size_t i = 0; i < std::min(fresh.size(), kMostInSentence); ++i) {
    char color[16];
    std::snprintf(color, sizeof color, "0x%06x", static_cast<unsigned>(fresh[i].second));
    append((encoding == Encoding::kNumber ? std::to_string(fresh[i].second) : color) +
           pointsText(fresh[i].first));
  }
  if (fresh.size() > kMostInSentence) {
    append(std::to_string(fresh.size() - kMostInSentence) + " more labels");
  }
  if (unlisted.missing() > 0 && !named_missing_) {
    named_missing_ = true;
    append("none at all" + pointsText(unlisted.missing()));
  }
  if (named_.size() == kMostNamed && !said_last_) {
    said_last_ = true;
    append("no further ones are named");
  }
  return text;
}

std::string LabelWatch::report(const ClassTable& classes, UnknownLabels treatment, const PointCounts& counts,
                               Span<const std::uint32_t> labels, const UnlistedLabels& unlisted,
                               LabelValues values, Encoding encoding) {
  if (counts.labels_not_in_table == 0 || unlisted.empty()) return "";
  if (see(labels, unlisted) || remedy_.empty()) {
    remedy_ = findRemedy(classes, unlisted, values, encoding);
  }
  const std::string names = nameNew(unlisted, encoding);
  if (names.empty()) return "";
  const double share = static_cast<double>(counts.labels_not_in_table) / static_cast<double>(counts.points);
  const auto as = treatment == UnknownLabels::kUnlabelled ? classes.unlabelled() : std::nullopt;
  return percentText(share) + " of the points of a scan have " +
         (encoding == Encoding::kNumber ? "labels" : "colours") + " that class table '" + classes.name() +
         "' does not list, and are " +
         (as ? "mapped as '" + classes.nameOf(*as) + "'" : std::string("left out of the map")) + ": " +
         names + "; " + remedy_;
}

std::string LabelWatch::report(const SemanticMapper& mapper, const ScanView& scan,
                               const PointCounts& counts) {
  if (counts.labels_not_in_table == 0) return "";
  const LabelValues values = scan.labels_are_ids ? LabelValues::kId : mapper.config().label_values;
  return report(mapper.classes(), mapper.config().unknown_labels, counts, scan.labels,
                unlistedLabels(scan.labels, mapper.classes(), values), values);
}

}  // namespace bki_mapping
