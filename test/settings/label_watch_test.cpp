// What is said of labels that the class table does not list.
#include "settings/label_watch.h"

#include <gtest/gtest.h>

#include <numeric>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/settings/yaml.h"

namespace bki_mapping {
namespace {

using Labels = std::vector<std::uint32_t>;
using Encoding = LabelWatch::Encoding;

/// What a watch says of a scan with these labels, all of whose points are otherwise good.
std::string saidOf(LabelWatch& watch, const Labels& labels, const std::string& table = "semantic_kitti",
                   LabelValues values = LabelValues::kRaw) {
  MapperConfig config;
  config.label_values = values;
  SemanticMapper mapper(config, std::make_shared<const ClassTable>(loadClassTable(table)));
  Scan scan;
  scan.labels = labels;
  scan.points.assign(labels.size(), Eigen::Vector3f(5.0f, 0.0f, 0.0f));
  return watch.report(mapper, scan, mapper.integrate(scan).counts);
}

std::string saidOf(const Labels& labels, const std::string& table = "semantic_kitti",
                   LabelValues values = LabelValues::kRaw) {
  LabelWatch watch;
  return saidOf(watch, labels, table, values);
}

#define EXPECT_NAMES(message, words) EXPECT_NE((message).find(words), std::string::npos) << (message)

Labels upTo(std::uint32_t last) {
  Labels labels(last + 1);
  std::iota(labels.begin(), labels.end(), 0u);
  return labels;
}

Labels rawLabelsOf(const std::string& table) {
  Labels labels;
  const ClassTable loaded = loadClassTable(table);
  for (const SemanticClass& c : loaded.classes()) labels.insert(labels.end(), c.raw.begin(), c.raw.end());
  return labels;
}

TEST(LabelWatch, SaysNothingOfGoodLabels) {
  for (const std::string& table : classTableNames())
    EXPECT_EQ(saidOf(rawLabelsOf(table), table), "") << table;
  EXPECT_EQ(saidOf({10u | 7u << 16, 252u | 300u << 16}), "") << "the mask of semantic_kitti";
  EXPECT_EQ(saidOf(upTo(19), "semantic_kitti", LabelValues::kId), "");
}

// The likeliest mistake of who runs a network. 0, 1, 10, 11, 13, 15, 16 and 18 are raw labels, too.
TEST(LabelWatch, KnowsTrainIds) {
  const std::string said = saidOf(upTo(19));
  EXPECT_NAMES(said,
               "60 % of the points of a scan have labels that class table 'semantic_kitti' does not list");
  EXPECT_NAMES(said, "left out of the map: 2 (1 point), 3 (1 point), ");
  EXPECT_NAMES(said, "; all labels seen are ids of the table; set label_values to id");
  EXPECT_NAMES(saidOf({50u, 40u, 252u}, "semantic_kitti", LabelValues::kId),
               "all labels seen are raw labels of the table; set label_values to raw");
}

TEST(LabelWatch, KnowsInstances) {
  SemanticClass car, road;
  car.name = "car";
  car.raw = {10};
  road.id = 1;
  road.name = "road";
  road.raw = {40};
  const ClassTable table("own", {car, road});
  const auto remedy = [&](const std::set<std::int64_t>& seen) {
    return labelRemedy(seen, table, LabelValues::kRaw, Encoding::kNumber, {});
  };
  EXPECT_EQ(remedy({10, 40 | 3 << 16, 10 | 1 << 16}),
            "the table has the lower 16 bits of all labels seen; set its label_mask to 0xFFFF");
  EXPECT_EQ(remedy({10, 40 | 3 << 8}),
            "the table has the lower 8 bits of all labels seen; set its label_mask to 0xFF");
  EXPECT_EQ(remedy({0, 1 | 3 << 16}),
            "the lower 16 bits of all labels seen are ids of the table; set its label_mask to 0xFFFF, and "
            "label_values to id");
  EXPECT_EQ(remedy({10, 41 | 3 << 16}), "") << "41 is nothing either way";
}

TEST(LabelWatch, KnowsOtherTables) {
  EXPECT_NAMES(saidOf(rawLabelsOf("semantic_kitti"), "carla"),
               "class table semantic_kitti has all labels seen; set classes to it");
  EXPECT_NAMES(saidOf({30, 24, 28}, "carla"), "class table nuscenes has all labels seen; set classes to it");
  EXPECT_NAMES(saidOf({13}, "kitti"),
               "class tables carla, nclt, nuscenes, semantic_kitti have all labels seen; set classes to the "
               "right one");
  EXPECT_NAMES(saidOf({4, 17, 19}, "kitti"), "nuscenes");
  EXPECT_NAMES(saidOf({252 | 1u << 16, 40}, "toy"), "class table semantic_kitti has all labels seen");
}

TEST(LabelWatch, SaysWhatElseMayHelp) {
  EXPECT_NAMES(saidOf({40, 10, 7777}),
               "7777 (1 point); list them in the table, set unknown_labels to unlabelled, or check that "
               "label_field holds labels");
  EXPECT_NAMES(saidOf({40, kNoLabel}),
               "-1 (1 point); list -1 under raw of its class 'unlabelled' if it stands for no label");
  EXPECT_NAMES(saidOf({40, kNoLabel - 1}), "4294967294 (1 point); list them in the table");
  const ClassTable table = loadClassTable("semantic_kitti");
  UnlistedLabels unlisted;
  PointCounts counts;
  counts.points = 10;
  counts.labels_not_in_table = 2;
  const auto said = [&](Encoding encoding) {
    return LabelWatch().report(table, UnknownLabels::kIgnore, counts, Labels(), unlisted, LabelValues::kRaw,
                               encoding);
  };
  unlisted.addMissing();
  EXPECT_NAMES(
      said(Encoding::kNumber),
      "20 % of the points of a scan have labels that class table 'semantic_kitti' does not list, and are "
      "left out of the map: none at all (1 point); check label_field, label_encoding and score_fields");
  unlisted.add(0xf59664);  // a car with red and blue exchanged
  EXPECT_NAMES(said(Encoding::kRgb), "colours that class table");
  EXPECT_NAMES(said(Encoding::kRgb), "0xf59664 (1 point)");
  EXPECT_NAMES(said(Encoding::kRgb), "set label_encoding to bgr");
  EXPECT_NAMES(said(Encoding::kBgr), "set label_encoding to rgb");
  unlisted.add(0x123456);
  EXPECT_NAMES(said(Encoding::kRgb), "color_match to nearest");
  unlisted = {};
  unlisted.add(0xff9e00);  // nuScenes' car
  EXPECT_NAMES(said(Encoding::kRgb), "class table nuscenes has them all; set classes to it");
  unlisted = {};
  unlisted.add(12 + 300 * 65536);
  unlisted.noteRounding();
  EXPECT_NAMES(said(Encoding::kNumber), "publish labels as integers");
}

TEST(LabelWatch, SaysWhatBecomesOfThePoints) {
  MapperConfig config;
  config.unknown_labels = UnknownLabels::kUnlabelled;
  SemanticMapper mapper(config, std::make_shared<const ClassTable>(loadClassTable("semantic_kitti")));
  Scan scan;
  scan.labels = {7777, 40};
  scan.points.assign(2, Eigen::Vector3f(5.0f, 0.0f, 0.0f));
  LabelWatch watch;
  EXPECT_NAMES(
      watch.report(mapper, scan, mapper.integrate(scan).counts),
      "50 % of the points of a scan have labels that class table 'semantic_kitti' does not list, and are "
      "mapped as 'unlabelled': 7777 (1 point)");
}

TEST(LabelWatch, NamesEachLabelOnceAndNotTooMany) {
  LabelWatch watch;
  EXPECT_NAMES(saidOf(watch, {7777, 7777, 40}), "7777 (2 points)");
  EXPECT_EQ(saidOf(watch, {7777, 40}), "");
  const std::string both = saidOf(watch, {7777, 8888, 40});
  EXPECT_NAMES(both, "8888 (1 point)");
  EXPECT_EQ(both.find("7777"), std::string::npos) << both;
  // A sender who invents labels gets few and short sentences.
  LabelWatch flooded;
  int sentences = 0;
  std::string first;
  for (std::uint32_t scan = 0; scan < 50; ++scan) {
    Labels labels(1000);
    std::iota(labels.begin(), labels.end(), 100000u + 1000u * scan);
    for (std::uint32_t& label : labels) label = label * 2654435761u | 0x8000u;
    const std::string said = saidOf(flooded, labels);
    sentences += !said.empty();
    EXPECT_LT(said.size(), 600u);
    if (scan == 0) first = said;
  }
  EXPECT_EQ(sentences, 1);
  EXPECT_NAMES(first, "56 more labels, no further ones are named");
}

// Train ids seen one after another: the advice rests on all of them.
TEST(LabelWatch, ChangesItsMind) {
  LabelWatch watch;
  EXPECT_NAMES(saidOf(watch, {2, 9, 40, 252}), "list them in the table");
  LabelWatch later;
  EXPECT_NAMES(saidOf(later, {9}), "label_values to id");
  EXPECT_EQ(saidOf(later, {9, 252, 80}), "") << "no new unknown label";
  EXPECT_EQ(later.remedy().find("label_values"), std::string::npos) << later.remedy();
}

}  // namespace
}  // namespace bki_mapping
