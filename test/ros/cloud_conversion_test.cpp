// Clouds of every layout are read correctly, and faulty ones are refused in one sentence.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <functional>

#include "bki_mapping/settings/yaml.h"
#include "cloud_maker.h"
#include "refusal_of.h"
#include "ros/cloud_conversion.h"
#include "ros/pose_conversion.h"

namespace bki_mapping::ros_interface {
namespace {

using sensor_msgs::PointField;

sensor_msgs::PointCloud2 twoPoints() {
  return makeCloud({{1, 2, 3}, {4, 5, 6}}, {0.5f, 0.25f}, {40, 252});
}

const ClassTable& classes() {
  static const ClassTable table = loadClassTable("semantic_kitti");
  return table;
}

CloudContent read(const sensor_msgs::PointCloud2& cloud, const std::string& field = "label") {
  InputConfig input;
  input.label_field = field;
  return readCloud(cloud, input, classes(), LabelValues::kRaw);
}

std::string faultOf(const sensor_msgs::PointCloud2& cloud, const std::string& field = "label") {
  return refusalOf([&] { read(cloud, field); });
}

TEST(Cloud, IsReadAsItWasMade) {
  const CloudContent content = read(twoPoints());
  EXPECT_EQ(content.points, (std::vector<Eigen::Vector3f>{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_EQ(content.labels.labels, (std::vector<std::uint32_t>{40, 252}));
  EXPECT_EQ(read(twoPoints(), "").labels.labels, (std::vector<std::uint32_t>{0, 0}));
}

TEST(Cloud, FloatLabelsAreRoundedAndNonsenseIsNoLabel) {
  sensor_msgs::PointCloud2 cloud = twoPoints();
  cloud.fields[4].datatype = PointField::FLOAT32;
  for (const auto& [value, label] : std::vector<std::pair<float, std::uint32_t>>{
           {40.0f, 40u}, {39.9f, 40u}, {-1.0f, 0xffffffffu}, {NAN, 0xffffffffu}, {1e20f, 0xffffffffu}}) {
    std::memcpy(cloud.data.data() + 16, &value, 4);
    EXPECT_EQ(read(cloud).labels.labels[0], label) << value;
  }
}

TEST(Cloud, RowsMayBePadded) {
  sensor_msgs::PointCloud2 cloud = twoPoints();
  cloud.height = 2;
  cloud.width = 1;
  cloud.row_step = 32;
  std::vector<std::uint8_t> padded(52, 0xee);
  std::memcpy(padded.data(), cloud.data.data(), 20);
  std::memcpy(padded.data() + 32, cloud.data.data() + 20, 20);
  cloud.data = padded;
  EXPECT_EQ(read(cloud).labels.labels, (std::vector<std::uint32_t>{40, 252}));
}

TEST(Cloud, RefusesWhatDoesNotFit) {
  sensor_msgs::PointCloud2 cloud = twoPoints();
  EXPECT_NE(faultOf(cloud, "class").find("no field 'class' (it has: x, y, z, intensity, label)"),
            std::string::npos);
  cloud.data.pop_back();
  EXPECT_NE(faultOf(cloud).find("40 bytes of points, but holds 39"), std::string::npos);
  cloud = twoPoints();
  cloud.width = 0xffffffffu;
  cloud.height = 0xffffffffu;
  EXPECT_NE(faultOf(cloud), "");
  cloud = twoPoints();
  cloud.fields[4].offset = 18;
  EXPECT_NE(faultOf(cloud).find("beyond its point_step 20"), std::string::npos);
  cloud.fields[4].offset = 0xfffffffeu;
  EXPECT_NE(faultOf(cloud), "");
  cloud = twoPoints();
  cloud.fields[0].datatype = 77;
  EXPECT_NE(faultOf(cloud).find("unknown datatype 77"), std::string::npos);
  cloud = twoPoints();
  cloud.point_step = 0;
  EXPECT_NE(faultOf(cloud), "");
  cloud.data.clear();
  EXPECT_NE(faultOf(cloud), "");
  cloud = twoPoints();
  cloud.fields[3].name = "label";
  EXPECT_NE(faultOf(cloud).find("two fields 'label'"), std::string::npos);
}

TEST(Cloud, ThousandsOfFieldsCostWhatTheyHold) {
  sensor_msgs::PointCloud2 cloud = twoPoints();
  constexpr std::uint32_t kComponents = 200000;
  cloud.width = 1;
  cloud.point_step = 4 * kComponents;
  cloud.data.resize(cloud.point_step);
  for (int i = 0; i < 5000; ++i) {
    cloud.fields.push_back(cloud.fields[0]);
    cloud.fields.back().name = "further_" + std::to_string(i) + std::string(1000, 'n');
  }
  cloud.fields[4].offset = 0;
  cloud.fields[4].count = kComponents;
  const auto start = std::chrono::steady_clock::now();
  EXPECT_EQ(readersOf(cloud, "label").size(), kComponents);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(5));
  // A sender cannot control the length of the message.
  const std::string fault = faultOf(cloud, "class");
  EXPECT_LT(fault.size(), 3000u);
  EXPECT_NE(fault.find("and 4985 more"), std::string::npos) << fault;
}

/// A cloud at the origin with arbitrary float fields; each row of values is a point.
sensor_msgs::PointCloud2 cloudOf(const std::vector<std::string>& names,
                                 const std::vector<std::vector<float>>& points) {
  sensor_msgs::PointCloud2 cloud;
  std::vector<std::string> all = {"x", "y", "z"};
  all.insert(all.end(), names.begin(), names.end());
  for (const std::string& name : all) {
    PointField field;
    field.name = name;
    field.offset = static_cast<std::uint32_t>(4 * cloud.fields.size());
    field.datatype = PointField::FLOAT32;
    field.count = 1;
    cloud.fields.push_back(field);
  }
  cloud.point_step = static_cast<std::uint32_t>(4 * all.size());
  cloud.height = 1;
  cloud.width = static_cast<std::uint32_t>(points.size());
  cloud.row_step = cloud.width * cloud.point_step;
  cloud.is_bigendian = hostIsBigEndian();
  cloud.data.resize(cloud.row_step);
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::memcpy(cloud.data.data() + i * cloud.point_step + 12, points[i].data(), 4 * points[i].size());
  }
  return cloud;
}

float packed(std::uint32_t color) {
  float value;
  std::memcpy(&value, &color, 4);
  return value;
}

std::uint32_t colorOfClass(const std::string& name) {
  for (const SemanticClass& c : classes().classes()) {
    if (c.name == name) return c.color[0] << 16 | c.color[1] << 8 | c.color[2];
  }
  throw std::invalid_argument(name);
}

ClassId idOf(const std::string& name) {
  for (const SemanticClass& c : classes().classes()) {
    if (c.name == name) return c.id;
  }
  throw std::invalid_argument(name);
}

/// The classes of points whose field `label` has these values, -1 without one; and what is not in the table.
std::pair<std::vector<int>, UnlistedLabels> classesOf(std::uint8_t datatype,
                                                      const std::vector<double>& values,
                                                      const ClassTable& table) {
  CloudMaker maker(std::vector<Eigen::Vector3f>(values.size(), {1, 2, 3}));
  maker.add("label", datatype, values);
  const CloudLabels labels = readCloud(maker.message(), InputConfig(), table, LabelValues::kRaw).labels;
  std::vector<int> found;
  for (const std::uint32_t label : labels.labels) {
    const auto id = table.classOfRaw(label);
    found.push_back(id ? int{*id} : -1);
  }
  return {found, labels.unknown};
}

// SemanticKITTI's own label files as a cloud: an instance in the upper 16 bits.
TEST(Labels, MayHaveAnInstanceInTheirUpperBits) {
  const int car = idOf("car"), person = idOf("person");
  const double kInstance = 65536.0;
  for (const auto datatype : {PointField::UINT32, PointField::FLOAT64, PointField::INT32}) {
    const auto [found, unlisted] =
        classesOf(datatype, {10.0, 10.0 + kInstance, 254.0 + 300.0 * kInstance, 252.0 + 32767.0 * kInstance},
                  classes());
    EXPECT_EQ(found, (std::vector<int>{car, car, person, car})) << int{datatype};
    EXPECT_TRUE(unlisted.empty()) << int{datatype};
  }
  // The highest bit makes a signed number negative; in two's complement, the class stays where it was.
  const auto [found, unlisted] =
      classesOf(PointField::INT32, {10.0 + 0x8001p0 * kInstance - 0x1p32, -1.0, -2.0}, classes());
  EXPECT_EQ(found, (std::vector<int>{car, -1, -1}));
  EXPECT_EQ(unlisted.counts(), (std::map<std::int64_t, std::size_t>{{-2, 1}, {-1, 1}}));
}

// 65536 * 300 + 11, a bicycle, would be 65536 * 300 + 12 in single precision.
TEST(Labels, OfSinglePrecisionMayHaveLostTheirClass) {
  const double kInstance = 65536.0;
  const auto [found, unlisted] = classesOf(
      PointField::FLOAT32, {11.0 + 200.0 * kInstance, 11.0 + 300.0 * kInstance, 16777216.0}, classes());
  EXPECT_EQ(found, (std::vector<int>{static_cast<int>(idOf("bicycle")), -1, idOf("unlabelled")}));
  EXPECT_EQ(unlisted.counts(), (std::map<std::int64_t, std::size_t>{{12 + 300 * 65536, 1}}));
  EXPECT_TRUE(unlisted.rounded());
}

// Nor is a class of its own to be trusted there: 16777217 would be 16777216, and 16777219 would be 16777220.
TEST(Labels, OfSinglePrecisionAreUnknownWhereThatSkipsNumbers) {
  SemanticClass small, great, negative;
  small.name = "small";
  small.raw = {16777216};
  great.name = "great";
  great.id = 1;
  great.raw = {16777220, 3221225472};
  negative.name = "negative";
  negative.id = 2;
  negative.raw = {0xff000000u};  // -2^24
  const ClassTable table("t", {small, great, negative});
  const std::vector<double> values = {16777216.0, 16777220.0, 3221225472.0, -16777216.0, -16777220.0};
  const auto [found, unlisted] = classesOf(PointField::FLOAT32, values, table);
  EXPECT_EQ(found, (std::vector<int>{0, -1, -1, 2, -1}));
  EXPECT_TRUE(unlisted.rounded());
  EXPECT_EQ(classesOf(PointField::FLOAT64, values, table).first, (std::vector<int>{0, 1, 1, 2, -1}));
}

TEST(Labels, MinusOneAndNoNumberAreTwoThings) {
  for (const auto datatype : {PointField::INT8, PointField::INT16, PointField::INT32, PointField::FLOAT32}) {
    const auto [found, unlisted] = classesOf(datatype, {40.0, -1.0, -1.0}, classes());
    EXPECT_EQ(found, (std::vector<int>{idOf("road"), -1, -1})) << int{datatype};
    EXPECT_EQ(unlisted.counts(), (std::map<std::int64_t, std::size_t>{{-1, 2}})) << int{datatype};
    EXPECT_EQ(unlisted.missing(), 0u) << int{datatype};
  }
  const auto [found, unlisted] = classesOf(PointField::FLOAT32, {NAN, INFINITY, -1.0}, classes());
  EXPECT_EQ(unlisted.counts(), (std::map<std::int64_t, std::size_t>{{-1, 1}}));
  EXPECT_EQ(unlisted.missing(), 2u);
  SemanticClass nothing, any;
  nothing.name = "nothing";
  nothing.raw = {kNoLabel};
  EXPECT_EQ(classesOf(PointField::INT8, {-1.0, 4.0}, ClassTable("t", {nothing}, 0xff)).first,
            (std::vector<int>{0, -1}));
}

TEST(Labels, ColoursMeanTheirClasses) {
  InputConfig input;
  input.label_field = "rgb";
  input.label_encoding = LabelEncoding::kRgb;
  const std::uint32_t car = colorOfClass("car"), road = colorOfClass("road");
  const std::uint32_t near_car = car ^ 0x010101u;
  const auto cloud = cloudOf({"rgb"}, {{packed(car)}, {packed(road | 0xff000000u)}, {packed(near_car)}});
  CloudLabels labels = readCloud(cloud, input, classes(), LabelValues::kRaw).labels;
  EXPECT_TRUE(labels.are_ids);
  EXPECT_EQ(labels.labels, (std::vector<std::uint32_t>{idOf("car"), idOf("road"), kNoLabel}));
  EXPECT_EQ(labels.unknown.counts(), (std::map<std::int64_t, std::size_t>{{near_car, 1}}));
  input.color_match = ColorMatch::kNearest;
  labels = readCloud(cloud, input, classes(), LabelValues::kRaw).labels;
  EXPECT_EQ(labels.labels, (std::vector<std::uint32_t>{idOf("car"), idOf("road"), idOf("car")}));
  EXPECT_TRUE(labels.unknown.empty());

  input.color_match = ColorMatch::kExact;
  input.label_encoding = LabelEncoding::kBgr;
  const std::uint32_t swapped = (car & 0xffu) << 16 | (car & 0xff00u) | car >> 16;
  labels = readCloud(cloudOf({"rgb"}, {{packed(swapped)}}), input, classes(), LabelValues::kRaw).labels;
  EXPECT_EQ(labels.labels, (std::vector<std::uint32_t>{idOf("car")}));

  input.label_field = "b, g, r";
  const auto part = [&](int shift) { return static_cast<float>(car >> shift & 0xffu); };
  labels = readCloud(cloudOf({"r", "g", "b"}, {{part(16), part(8), part(0)}, {300.0f, 0.0f, 0.0f}}), input,
                     classes(), LabelValues::kRaw)
               .labels;
  EXPECT_EQ(labels.labels, (std::vector<std::uint32_t>{idOf("car"), kNoLabel}));
  input.label_field = "r,g";
  EXPECT_THROW(readCloud(cloudOf({"r", "g"}, {}), input, classes(), LabelValues::kRaw),
               std::invalid_argument);
}

TEST(Labels, ScoresBecomeShares) {
  InputConfig input;
  input.label_encoding = LabelEncoding::kScores;
  input.score_fields = "car=p_car, road=p_road";
  const auto cloud = cloudOf({"p_road", "p_car"}, {{1.0f, 3.0f}, {2.0f, 0.0f}, {0.0f, NAN}});
  CloudLabels labels = readCloud(cloud, input, classes(), LabelValues::kRaw).labels;
  EXPECT_EQ(labels.labels, (std::vector<std::uint32_t>{idOf("car"), idOf("road"), kNoLabel}));
  ASSERT_EQ(labels.soft.size(), 3u);
  ASSERT_EQ(labels.soft.end(0) - labels.soft.begin(0), 2);
  EXPECT_EQ(labels.soft.begin(0)[0].id, idOf("car"));
  EXPECT_FLOAT_EQ(labels.soft.begin(0)[0].share, 0.75f);
  EXPECT_FLOAT_EQ(labels.soft.begin(0)[1].share, 0.25f);
  EXPECT_EQ(labels.soft.end(1) - labels.soft.begin(1), 1);
  EXPECT_EQ(labels.soft.end(2) - labels.soft.begin(2), 0);
  EXPECT_EQ(labels.unknown.missing(), 1u);

  input.score_type = ScoreType::kLogit;
  labels =
      readCloud(cloudOf({"p_road", "p_car"}, {{0.0f, std::log(3.0f)}}), input, classes(), LabelValues::kRaw)
          .labels;
  EXPECT_FLOAT_EQ(labels.soft.begin(0)[0].share, 0.75f);
  input.score_fields = "lorry=p_car";
  EXPECT_THROW(readCloud(cloud, input, classes(), LabelValues::kRaw), std::invalid_argument);
}

TEST(Labels, OneFieldMayHoldAScoreForEachClass) {
  std::vector<std::string> names;
  std::vector<float> point(classes().size(), 0.0f);
  for (std::size_t c = 0; c < classes().size(); ++c) names.push_back("s" + std::to_string(c));
  point[2] = 1.0f;
  sensor_msgs::PointCloud2 cloud = cloudOf(names, {point});
  cloud.fields[3].count = static_cast<std::uint32_t>(classes().size());
  InputConfig input;
  input.label_encoding = LabelEncoding::kScores;
  input.score_fields = "s0";
  EXPECT_EQ(readCloud(cloud, input, classes(), LabelValues::kRaw).labels.labels[0],
            classes().classes()[2].id);
  cloud.fields[3].count = 0xffffffffu;
  EXPECT_THROW(readCloud(cloud, input, classes(), LabelValues::kRaw), std::invalid_argument);
  cloud.fields[3].count = 3;
  EXPECT_THROW(readCloud(cloud, input, classes(), LabelValues::kRaw), std::invalid_argument);
}

TEST(Labels, TopKNamesTheLikeliest) {
  InputConfig input;
  input.label_encoding = LabelEncoding::kTopK;
  input.label_field = "first,second";
  input.score_fields = "p1,p2";
  // 10 and 252 are both cars; 12345 is not in the table.
  const auto cloud = cloudOf({"first", "p1", "second", "p2"},
                             {{40, 0.6f, 10, 0.2f}, {10, 0.3f, 252, 0.3f}, {12345, 0.9f, 40, 0.1f}});
  const CloudLabels labels = readCloud(cloud, input, classes(), LabelValues::kRaw).labels;
  EXPECT_EQ(labels.labels, (std::vector<std::uint32_t>{idOf("road"), idOf("car"), idOf("road")}));
  EXPECT_FLOAT_EQ(labels.soft.begin(0)[1].share, 0.75f);  // ascending by id: car, road
  EXPECT_EQ(labels.soft.end(1) - labels.soft.begin(1), 1);
  EXPECT_FLOAT_EQ(labels.soft.begin(2)->share, 1.0f);
  EXPECT_EQ(labels.unknown.counts().at(12345), 1u);
  input.score_fields = "p1";
  EXPECT_THROW(readCloud(cloud, input, classes(), LabelValues::kRaw), std::invalid_argument);
}

/// The soft label of the only point of a cloud with the scores of a car and a road.
std::vector<ClassShare> sharesOf(double car, double road, ScoreType type, std::uint8_t datatype) {
  CloudMaker maker({{1, 2, 3}});
  maker.add("car", datatype, {car}).add("road", datatype, {road});
  InputConfig input;
  input.label_encoding = LabelEncoding::kScores;
  input.score_fields = "car=car,road=road";
  input.score_type = type;
  const CloudLabels labels = readCloud(maker.message(), input, classes(), LabelValues::kRaw).labels;
  return {labels.soft.begin(0), labels.soft.end(0)};
}

TEST(Labels, ScoresOfAnySizeBecomeSharesInProportion) {
  const auto expect = [](const std::vector<ClassShare>& shares, float car, float road) {
    ASSERT_EQ(shares.size(), static_cast<std::size_t>(car > 0.0f) + static_cast<std::size_t>(road > 0.0f));
    for (const ClassShare& s : shares) EXPECT_FLOAT_EQ(s.share, s.id == idOf("car") ? car : road);
  };
  constexpr auto kProbability = ScoreType::kProbability, kLogit = ScoreType::kLogit;
  constexpr std::uint8_t kFloat = PointField::FLOAT32, kDouble = PointField::FLOAT64;
  const double inf = INFINITY, great = std::numeric_limits<double>::max();
  expect(sharesOf(1e39, 3e39, kProbability, kDouble), 0.25f, 0.75f);  // exceeds a float
  expect(sharesOf(great, great, kProbability, kDouble), 0.5f, 0.5f);  // their sum exceeds a double
  expect(sharesOf(3e38, 3e38, kProbability, kFloat), 0.5f, 0.5f);     // their sum exceeds a float
  expect(sharesOf(1e-320, 3e-320, kProbability, kDouble), 1.0f / 4.0f, 3.0f / 4.0f);
  expect(sharesOf(0.5, -1e300, kProbability, kDouble), 1.0f, 0.0f);
  expect(sharesOf(-0.0, 2.0, kProbability, kDouble), 0.0f, 1.0f);
  expect(sharesOf(-inf, 2.0, kProbability, kDouble), 0.0f, 1.0f);
  expect(sharesOf(1e308, -1e308, kLogit, kDouble), 1.0f, 0.0f);
  expect(sharesOf(3e7, 3e7 + std::log(3.0), kLogit, kDouble), 0.25f,
         0.75f);                                                // floats of this size are integers
  expect(sharesOf(-inf, -1e308, kLogit, kDouble), 0.0f, 1.0f);  // one impossible, the other certain
  // Makes the point unusable: leaving out the score would give the point to the other class.
  for (const ScoreType type : {kProbability, kLogit}) {
    for (const double bad : {inf, static_cast<double>(NAN)}) {
      expect(sharesOf(bad, 2.0, type, kDouble), 0.0f, 0.0f);
      expect(sharesOf(bad, bad, type, kFloat), 0.0f, 0.0f);
    }
  }
  expect(sharesOf(-inf, -inf, kLogit, kFloat), 0.0f, 0.0f);
  expect(sharesOf(0.0, -1.0, kProbability, kFloat), 0.0f, 0.0f);
}

TEST(Labels, ANumberThatIsNoColourIsNotWhite) {
  InputConfig input;
  input.label_encoding = LabelEncoding::kRgb;
  input.color_match = ColorMatch::kNearest;
  CloudMaker maker(std::vector<Eigen::Vector3f>(3, {1, 2, 3}));
  maker.add("label", PointField::FLOAT64, {NAN, -1.0, 1e300});
  const CloudLabels labels = readCloud(maker.message(), input, classes(), LabelValues::kRaw).labels;
  EXPECT_EQ(labels.labels, (std::vector<std::uint32_t>(3, kNoLabel)));
  EXPECT_EQ(labels.unknown.missing(), 3u);
}

TEST(Pose, SurvivesTheTripThroughAMessage) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translate(Eigen::Vector3d(1, -2, 3))
      .rotate(Eigen::AngleAxisd(2.5, Eigen::Vector3d(1, 2, 3).normalized()));
  EXPECT_TRUE(toIsometry(toTransform(T)).isApprox(T, 1e-12));
}

}  // namespace
}  // namespace bki_mapping::ros_interface
