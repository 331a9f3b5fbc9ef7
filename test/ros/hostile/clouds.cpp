#include <algorithm>
#include <cmath>
#include <cstring>

#include "kinds.h"

namespace bki_mapping::hostile {
namespace {

using sensor_msgs::PointCloud2;
using sensor_msgs::PointField;

constexpr std::uint32_t kMax = 0xffffffffu;

std::size_t sizeOf(std::uint8_t datatype) {
  constexpr std::size_t kSizes[] = {0, 1, 1, 2, 2, 4, 4, 4, 8};
  return datatype < 9 ? kSizes[datatype] : 0;
}

PointField* find(PointCloud2& cloud, const std::string& name) {
  const auto found = std::find_if(cloud.fields.begin(), cloud.fields.end(),
                                  [&](const PointField& field) { return field.name == name; });
  return found == cloud.fields.end() ? nullptr : &*found;
}

std::size_t pointsOf(const PointCloud2& cloud) {
  return cloud.point_step == 0 ? 0 : cloud.data.size() / cloud.point_step;
}

void addField(PointCloud2& cloud, const std::string& name, std::uint8_t datatype, std::uint32_t count) {
  PointField field;
  field.name = name;
  field.offset = cloud.point_step;
  field.datatype = datatype;
  field.count = count;
  cloud.fields.push_back(field);
  cloud.point_step += static_cast<std::uint32_t>(sizeOf(datatype)) * count;
}

void addFurtherFields(PointCloud2& cloud) {
  for (int i = 0; i < 5000; ++i) {
    cloud.fields.push_back(cloud.fields[0]);
    cloud.fields.back().name = "further_" + std::to_string(i);
  }
}

template <typename T>
void store(T value, std::uint8_t* bytes) {
  std::memcpy(bytes, &value, sizeof(T));
}

/// Writes a component of a point in the byte order of this machine, unless it is outside of the data. Values
/// that an integer field cannot represent become 0.
void put(PointCloud2& cloud, const std::string& name, std::size_t point, std::uint32_t component,
         double value) {
  const PointField* field = find(cloud, name);
  if (!field || sizeOf(field->datatype) == 0) return;
  const std::size_t size = sizeOf(field->datatype);
  const std::size_t place = point * cloud.point_step + field->offset + component * size;
  if (place + size > cloud.data.size()) return;
  std::uint8_t* bytes = cloud.data.data() + place;
  const auto whole = std::abs(value) < 1e15 ? static_cast<std::int64_t>(value) : 0;
  switch (field->datatype) {
    case PointField::INT8:
    case PointField::UINT8:
      return store(static_cast<std::uint8_t>(whole & 0xff), bytes);
    case PointField::INT16:
    case PointField::UINT16:
      return store(static_cast<std::uint16_t>(whole & 0xffff), bytes);
    case PointField::INT32:
    case PointField::UINT32:
      return store(static_cast<std::uint32_t>(whole & 0xffffffff), bytes);
    case PointField::FLOAT32:
      return store(static_cast<float>(value), bytes);
    default:
      return store(value, bytes);
  }
}

/// Sets all three coordinates of some or all points.
void scatter(PointCloud2& cloud, Dice& dice, const std::function<double()>& value) {
  const std::size_t one_in = 1 + dice.below(3);
  for (std::size_t p = 0; p < pointsOf(cloud); ++p) {
    if (!dice.oneIn(one_in)) continue;
    for (const char* axis : {"x", "y", "z"}) put(cloud, axis, p, 0, value());
  }
}

void setAll(PointCloud2& cloud, const std::string& name, std::uint32_t components,
            const std::function<double()>& value) {
  for (std::size_t p = 0; p < pointsOf(cloud); ++p) {
    for (std::uint32_t c = 0; c < components; ++c) put(cloud, name, p, c, value());
  }
}

/// Adds a field at the end of each point, and removes other fields of the same name.
void replaceField(PointCloud2& cloud, const std::string& name, std::uint8_t datatype,
                  const std::function<double()>& value) {
  const std::size_t points = pointsOf(cloud), before = cloud.point_step;
  cloud.fields.erase(std::remove_if(cloud.fields.begin(), cloud.fields.end(),
                                    [&](const PointField& field) { return field.name == name; }),
                     cloud.fields.end());
  addField(cloud, name, datatype, 1);
  std::vector<std::uint8_t> data(points * cloud.point_step);
  for (std::size_t p = 0; p < points; ++p) {
    std::copy_n(cloud.data.begin() + static_cast<std::ptrdiff_t>(p * before), before,
                data.begin() + static_cast<std::ptrdiff_t>(p * cloud.point_step));
  }
  cloud.data = data;
  cloud.row_step = cloud.point_step * cloud.width;
  setAll(cloud, name, 1, value);
}

const std::vector<std::string> kCoordinates = {"x", "y", "z"};
const std::vector<double> kOddTimes = {kNan, kInf, -kInf, 1e300, -1e300, 1e9, 11.0, -11.0};
const std::vector<double> kOddScores = {kNan, kInf, -kInf, 1e39, 3e38, 1e-45, 0.0, -1.0, -1e39};

CloudKind kind(const std::string& name, const std::string& sent, const Answers& answers,
               const std::function<void(PointCloud2&, Dice&)>& change) {
  return {name, sent, answers, change};
}

std::vector<CloudKind> honestKinds() {
  return {
      kind("cloud/honest", "an honest cloud of 1 to 400 points", {"mapped"}, [](PointCloud2&, Dice&) {}),
      kind("cloud/padded_rows", "rows with bytes between them", {"mapped"},
           [](PointCloud2& c, Dice& dice) {
             const std::size_t padding = 1 + dice.below(64), row = std::size_t{c.width} * c.point_step;
             std::vector<std::uint8_t> data;
             for (std::size_t r = 0; r < c.height; ++r) {
               const auto begin = c.data.begin() + static_cast<std::ptrdiff_t>(r * row);
               data.insert(data.end(), begin, begin + static_cast<std::ptrdiff_t>(row));
               data.insert(data.end(), padding, 0xff);
             }
             c.data = data;
             c.row_step = static_cast<std::uint32_t>(row + padding);
           }),
      kind("cloud/big_endian", "a true big-endian cloud", {"mapped"},
           [](PointCloud2& c, Dice&) { swapBytes(c); }),
      kind("cloud/big_endian_lie", "is_bigendian without swapped bytes",
           {"mapped", "bad cloud", "transform late", "too old"},
           [](PointCloud2& c, Dice&) { c.is_bigendian = !c.is_bigendian; }),
      kind("cloud/is_dense_lie", "is_dense, with NaN", {"mapped"},
           [](PointCloud2& c, Dice& dice) {
             c.is_dense = 1;
             scatter(c, dice, [] { return kNan; });
           }),
  };
}

std::vector<CloudKind> sizeKinds() {
  return {
      kind("size/width_0", "width 0", {"empty"}, [](PointCloud2& c, Dice&) { c.width = 0; }),
      kind("size/height_0", "height 0", {"empty"}, [](PointCloud2& c, Dice&) { c.height = 0; }),
      kind("size/width", "a width beyond the data", {"bad cloud"},
           [](PointCloud2& c, Dice& dice) {
             c.width += 1 + static_cast<std::uint32_t>(dice.below(kMax - 500));
           }),
      kind("size/height", "a height beyond the data", {"bad cloud"},
           [](PointCloud2& c, Dice& dice) {
             c.height += 1 + static_cast<std::uint32_t>(dice.below(kMax - 50));
           }),
      kind("size/overflow", "width, height and steps whose products overflow 32 and 64 bits", {"bad cloud"},
           [](PointCloud2& c, Dice& dice) {
             const std::vector<std::uint32_t> large = {1u << 16, 1u << 31, (1u << 31) + 1, kMax, kMax - 1};
             c.width = dice.oneOf(large);
             c.height = dice.oneOf(large);
             c.point_step = dice.oneOf(large);
             c.row_step = dice.oneIn(2) ? c.width * c.point_step : dice.oneOf(large);
           }),
      kind("size/steps_0", "4 billion rows of 4 billion points of 0 bytes", {"bad cloud"},
           [](PointCloud2& c, Dice& dice) {
             c.point_step = c.row_step = 0;
             if (dice.oneIn(2)) c.width = c.height = kMax;
           }),
      kind("size/point_step_short", "a point_step shorter than the fields", {"bad cloud"},
           [](PointCloud2& c, Dice& dice) { c.point_step = static_cast<std::uint32_t>(dice.below(12)); }),
      kind("size/point_step_long", "a point_step beyond the data", {"bad cloud"},
           [](PointCloud2& c, Dice& dice) {
             c.point_step += 1 + static_cast<std::uint32_t>(dice.below(kMax - 500));
           }),
      kind("size/row_step", "a row_step of 0, or a random one", {"mapped", "bad cloud"},
           [](PointCloud2& c, Dice& dice) {
             c.row_step = dice.oneIn(2) ? 0 : static_cast<std::uint32_t>(dice.bits());
           }),
      kind("size/data_short", "data cut off", {"bad cloud"},
           [](PointCloud2& c, Dice& dice) { c.data.resize(dice.below(c.data.size())); }),
      kind("size/data_long", "more data than the sizes say", {"mapped"},
           [](PointCloud2& c, Dice& dice) { c.data.resize(c.data.size() + dice.below(100000), 0xff); }),
      kind("size/random", "random sizes", {"mapped", "bad cloud", "empty"},
           [](PointCloud2& c, Dice& dice) {
             const auto small = [&] {
               return static_cast<std::uint32_t>(dice.below(std::size_t{1} << dice.below(33)));
             };
             c.width = small();
             c.height = small();
             c.point_step = small();
             c.row_step = small();
           }),
  };
}

std::vector<CloudKind> fieldKinds() {
  return {
      kind("field/none", "no fields", {"bad cloud"}, [](PointCloud2& c, Dice&) { c.fields.clear(); }),
      kind("field/missing", "no x, y or z", {"bad cloud"},
           [](PointCloud2& c, Dice& dice) {
             c.fields.erase(c.fields.begin() + static_cast<std::ptrdiff_t>(dice.below(3)));
           }),
      kind("field/twice", "a coordinate twice", {"bad cloud"},
           [](PointCloud2& c, Dice& dice) { c.fields.push_back(c.fields[dice.below(3)]); }),
      kind("field/datatype", "a coordinate of an unknown datatype", {"bad cloud"},
           [](PointCloud2& c, Dice& dice) {
             c.fields[dice.below(3)].datatype = dice.oneOf<std::uint8_t>({0, 9, 10, 127, 128, 255});
           }),
      kind("field/datatype_other", "coordinates and labels of other datatypes than their bytes",
           {"mapped", "bad cloud", "transform late", "too old"},
           [](PointCloud2& c, Dice& dice) {
             for (PointField& field : c.fields) {
               if (dice.oneIn(3)) field.datatype = static_cast<std::uint8_t>(1 + dice.below(8));
             }
           }),
      kind("field/offset", "an offset beyond point_step", {"bad cloud"},
           [](PointCloud2& c, Dice& dice) {
             c.fields[dice.below(3)].offset =
                 dice.oneOf<std::uint32_t>({c.point_step - 3, c.point_step, kMax - 3, kMax, 1u << 31});
           }),
      kind("field/overlap", "all fields at one offset", {"mapped", "bad cloud", "transform late", "too old"},
           [](PointCloud2& c, Dice& dice) {
             const auto offset = static_cast<std::uint32_t>(dice.below(8));
             for (PointField& field : c.fields) field.offset = offset;
           }),
      kind("field/count", "counts of 0, 2 and 4 billion", {"mapped", "bad cloud"},
           [](PointCloud2& c, Dice& dice) {
             for (PointField& field : c.fields)
               field.count = dice.oneOf<std::uint32_t>({0, 1, 2, kMax, 1u << 31});
           }),
      kind("field/name_empty", "fields without names", {"bad cloud"},
           [](PointCloud2& c, Dice&) {
             for (PointField& field : c.fields) field.name.clear();
           }),
      kind("field/name_long", "names of 1 MB", {"bad cloud"},
           [](PointCloud2& c, Dice& dice) { c.fields[dice.below(3)].name.assign(1000000, 'x'); }),
      kind("field/name_not_utf8", "names that are not UTF-8, with zeros, line ends and codes of terminals",
           {"bad cloud"},
           [](PointCloud2& c, Dice& dice) {
             c.fields[dice.below(3)].name = std::string("x\0\xff\xfe\xc0\x80\n\033[2J%s%n", 16);
           }),
      kind("field/many", "5000 further fields", {"mapped"},
           [](PointCloud2& c, Dice&) { addFurtherFields(c); }),
      kind("field/many_components",
           "one point of 1.6 MB, with fields of 400,000 components, and 5000 further fields",
           {"mapped", "bad cloud"},
           [](PointCloud2& c, Dice&) {
             constexpr std::uint32_t kComponents = 400000;
             c.width = c.height = 1;
             c.point_step += 4 * kComponents;
             c.row_step = c.point_step;
             c.data.resize(c.point_step);
             for (const char* name : {"label", "rgb", "scores", "labels", "label_scores"}) {
               if (PointField* field = find(c, name)) field->count = kComponents;
             }
             addFurtherFields(c);
           }),
      kind("field/many_wrong", "5000 further fields, and no x", {"bad cloud"},
           [](PointCloud2& c, Dice&) {
             addFurtherFields(c);
             c.fields[0].name = "X";
           }),
  };
}

std::vector<CloudKind> cloudValueKinds() {
  const auto scattered = [](const std::vector<double>& values) {
    return [values](PointCloud2& c, Dice& dice) { scatter(c, dice, [&] { return dice.oneOf(values); }); };
  };
  return {
      kind("value/nan", "coordinates that are NaN", {"mapped"}, scattered({kNan, -kNan, 1.0})),
      kind("value/infinite", "infinite coordinates", {"mapped"}, scattered({kInf, -kInf, 1.0})),
      kind("value/denormal", "coordinates of 1e-45 to 1e-38 m", {"mapped"},
           scattered({1e-45, -1e-45, 1e-38, -1e-38, 1e-40})),
      kind("value/huge", "coordinates of 1e15 to 3e38 m", {"mapped", "bad cloud"},
           scattered({1e15, -1e15, 1e19, -1e20, 1e38, -1e38, 3.4e38})),
      kind("value/far", "a few points at 1e6 to 1e9 m", {"mapped", "bad cloud"},
           [](PointCloud2& c, Dice& dice) {
             for (int i = 0; i < 3; ++i) {
               const std::size_t p = dice.below(std::max<std::size_t>(pointsOf(c), 1));
               put(c, dice.oneOf(kCoordinates), p, 0, dice.oneOf<double>({1e6, -1e6, 1e7, -1e7, 1e8, 1e9}));
             }
           }),
      kind("value/millimetres", "a cloud in millimetres", {"bad cloud", "mapped"},
           [](PointCloud2& c, Dice& dice) {
             for (const std::string& axis : kCoordinates) {
               setAll(c, axis, 1, [&] { return dice.between(-15000.0, 15000.0); });
             }
           }),
      kind("value/at_sensor", "all points within 1 mm of the sensor", {"mapped"},
           [](PointCloud2& c, Dice& dice) {
             for (const std::string& axis : kCoordinates) {
               setAll(c, axis, 1, [&] { return dice.between(-6e-4, 6e-4); });
             }
           }),
      kind("value/zero", "all points at 0, 0, 0", {"mapped"},
           [](PointCloud2& c, Dice&) {
             for (const std::string& axis : kCoordinates) setAll(c, axis, 1, [] { return 0.0; });
           }),
      kind("value/identical", "all points at one place", {"mapped"},
           [](PointCloud2& c, Dice& dice) {
             for (const std::string& axis : kCoordinates) {
               const double value = dice.oneIn(3) ? 0.0 : dice.between(-20.0, 20.0);
               setAll(c, axis, 1, [&] { return value; });
             }
           }),
      kind("value/on_faces", "all points on the faces between voxels", {"mapped"},
           [](PointCloud2& c, Dice& dice) {
             for (const std::string& axis : kCoordinates) {
               setAll(c, axis, 1, [&] { return 0.3 * static_cast<double>(dice.below(80)) - 12.0; });
             }
           }),
      kind("value/on_an_axis", "all points on the z axis", {"mapped"},
           [](PointCloud2& c, Dice& dice) {
             for (const char* axis : {"x", "y"}) setAll(c, axis, 1, [] { return 0.0; });
             setAll(c, "z", 1, [&] { return dice.between(-20.0, 20.0); });
           }),
      kind("value/doubles", "x in double precision, up to 1e308 m", {"mapped"},
           [](PointCloud2& c, Dice& dice) {
             replaceField(c, "x", PointField::FLOAT64, [&] {
               return dice.oneOf<double>({1.0, -3.0, 1e300, -1e308, kNan, 1e-308, 5e-324});
             });
           }),
      kind("value/random_bytes", "random bytes", {"mapped", "bad cloud", "transform late", "too old"},
           [](PointCloud2& c, Dice& dice) {
             for (std::uint8_t& byte : c.data) byte = static_cast<std::uint8_t>(dice.bits());
           }),
      kind("value/no_returns", "rows and columns of NaN and infinity", {"mapped"},
           [](PointCloud2& c, Dice& dice) {
             const std::size_t row = dice.below(c.height), column = dice.below(c.width);
             const bool all = dice.oneIn(4);
             for (std::size_t p = 0; p < pointsOf(c); ++p) {
               if (!all && p / c.width != row && p % c.width != column) continue;
               for (const std::string& axis : kCoordinates) {
                 put(c, axis, p, 0, dice.oneOf<double>({kNan, kNan, kInf, -kInf, 0.0}));
               }
             }
           }),
      kind("value/infinite_ways", "infinity times the direction of a point, in all coordinates", {"mapped"},
           [](PointCloud2& c, Dice& dice) {
             for (std::size_t p = 0; p < pointsOf(c); ++p) {
               if (dice.oneIn(3)) continue;
               for (const std::string& axis : kCoordinates)
                 put(c, axis, p, 0, dice.between(-1.0, 1.0) * kInf);
             }
           }),
      kind("value/rings", "a spinning lidar's rings as rows or columns, with beams without a return",
           {"mapped"},
           [](PointCloud2& c, Dice& dice) {
             const bool columns = dice.oneIn(2);
             const double tilt = dice.between(-1.0, 1.0), none = dice.oneOf<double>({kNan, 0.0, kInf});
             const std::uint32_t most = 1 + static_cast<std::uint32_t>(dice.below(10));
             for (std::size_t p = 0; p < pointsOf(c); ++p) {
               const auto row = static_cast<double>(p / c.width), column = static_cast<double>(p % c.width);
               const double e = 0.02 * (columns ? column : row) - 0.3, a = 0.1 * (columns ? row : column);
               const double x = std::cos(a) * std::cos(e), z = std::sin(e), range = dice.between(0.0, 9.0);
               const bool hole = dice.below(10) < most;
               put(c, "x", p, 0, (hole ? none : range) * (x * std::cos(tilt) - z * std::sin(tilt)));
               put(c, "y", p, 0, (hole ? none : range) * std::sin(a) * std::cos(e));
               put(c, "z", p, 0, (hole ? none : range) * (x * std::sin(tilt) + z * std::cos(tilt)));
             }
           }),
  };
}

std::vector<CloudKind> labelKinds() {
  const auto labelled = [](std::uint8_t datatype, const std::vector<double>& values) {
    return [datatype, values](PointCloud2& c, Dice& dice) {
      replaceField(c, "label", datatype, [&] { return dice.oneOf(values); });
    };
  };
  return {
      kind("label/unknown", "numbers of no class", {"mapped"},
           labelled(PointField::UINT32, {7777.0, 4.0, 255.0, 256.0, 65535.0})),
      kind("label/many", "a different number for each point", {"mapped"},
           [](PointCloud2& c, Dice& dice) {
             replaceField(c, "label", PointField::UINT32,
                          [&] { return static_cast<double>(dice.below(kMax)); });
           }),
      kind("label/negative", "negative numbers", {"mapped"},
           labelled(PointField::INT32, {-1.0, -5.0, -2147483648.0})),
      kind("label/huge", "numbers of 32 bits", {"mapped"},
           labelled(PointField::UINT32, {4294967295.0, 4294967294.0, 2147483648.0})),
      kind("label/nan", "NaN and infinite numbers", {"mapped"},
           labelled(PointField::FLOAT32, {kNan, kInf, -kInf})),
      kind("label/float", "numbers with fractions, and beyond 32 bits", {"mapped"},
           labelled(PointField::FLOAT64, {0.5, 1.49, 1.5, -0.4, 1e10, 1e300, 4294967295.4})),
      kind("label/instance", "numbers of classes, with any object in the upper 16 bits", {"mapped"},
           [](PointCloud2& c, Dice& dice) {
             replaceField(c, "label", PointField::UINT32, [&] {
               return static_cast<double>(dice.below(0x10000) << 16 |
                                          dice.oneOf<std::size_t>({10, 40, 252, 7777}));
             });
           }),
      kind("label/instance_float", "the same in single precision, which rounds them", {"mapped"},
           [](PointCloud2& c, Dice& dice) {
             replaceField(c, "label", PointField::FLOAT32, [&] {
               return static_cast<double>(dice.below(0x10000) << 16 |
                                          dice.oneOf<std::size_t>({10, 11, 252, 259}));
             });
           }),
      kind("label/minus_one", "-1 in a byte, as a network writes it for no label", {"mapped"},
           labelled(PointField::INT8, {-1.0, -1.0, 40.0, -128.0})),
      kind("label/missing", "no field of labels, colours or scores", {"mapped", "bad cloud"},
           [](PointCloud2& c, Dice&) { c.fields.resize(3); }),
      kind("label/alpha", "packed colours with an alpha", {"mapped"},
           [](PointCloud2& c, Dice& dice) { setAlpha(c, dice); }),
      kind("label/colours", "colours of no class", {"mapped"},
           [](PointCloud2& c, Dice& dice) {
             replaceField(c, "rgb", PointField::UINT32,
                          [&] { return static_cast<double>(dice.below(kMax)); });
           }),
      kind("label/scores", "scores that are NaN, infinite, negative, 0 or 1e39", {"mapped"},
           [](PointCloud2& c, Dice& dice) {
             setAll(c, "scores", 4, [&] { return dice.oneOf(kOddScores); });
             setAll(c, "label_scores", 3, [&] { return dice.oneOf(kOddScores); });
           }),
      kind("label/scores_0", "scores that are all 0, or all NaN", {"mapped"},
           [](PointCloud2& c, Dice& dice) {
             const double value = dice.oneOf<double>({0.0, kNan, -1.0, kInf, -kInf});
             setAll(c, "scores", 4, [&] { return value; });
             setAll(c, "label_scores", 3, [&] { return value; });
           }),
      kind("label/scores_double", "scores in double precision, up to 1e308", {"mapped", "bad cloud"},
           [](PointCloud2& c, Dice& dice) {
             replaceField(c, "scores", PointField::FLOAT64, [&] {
               return dice.oneOf<double>({1e39, 1e308, 0.1, kNan, -1e308, 5e-324});
             });
           }),
      kind("label/counts", "more or fewer scores than classes or labels", {"mapped", "bad cloud"},
           [](PointCloud2& c, Dice& dice) {
             for (const char* name : {"scores", "labels", "label_scores"}) {
               if (PointField* field = find(c, name))
                 field->count = static_cast<std::uint32_t>(1 + dice.below(6));
             }
           }),
      kind("label/top_k", "likeliest labels that are unknown, or one class three times", {"mapped"},
           [](PointCloud2& c, Dice& dice) {
             setAll(c, "labels", 3, [&] { return dice.oneOf<double>({1.0, 1.0, 2.0, 77.0, 65535.0}); });
           }),
  };
}

std::vector<CloudKind> cloudTimeKinds() {
  return {
      kind(
          "time/odd", "times of points that are NaN, infinite or years",
          {"mapped", "bad cloud", "transform late", "too old"},
          [](PointCloud2& c, Dice& dice) { setAll(c, "seconds", 1, [&] { return dice.oneOf(kOddTimes); }); }),
      kind("time/odd_last", "such a time, of the last point only",
           {"mapped", "bad cloud", "transform late", "too old"},
           [](PointCloud2& c, Dice& dice) {
             put(c, "seconds", std::max<std::size_t>(pointsOf(c), 1) - 1, 0, dice.oneOf(kOddTimes));
           }),
      kind("time/long", "times up to 10 s before and after the cloud's",
           {"mapped", "bad cloud", "transform late", "too old"},
           [](PointCloud2& c, Dice& dice) {
             setAll(c, "seconds", 1, [&] { return dice.between(-10.0, 10.0); });
           }),
      kind("time/absolute", "times since 1970, in s, ms, us or ns", {"mapped"},
           [](PointCloud2& c, Dice& dice) {
             const double unit = dice.oneOf<double>({1.0, 1e3, 1e6, 1e9});
             setAll(c, "seconds", 1,
                    [&] { return unit * (c.header.stamp.toSec() + dice.between(0.0, 0.1)); });
           }),
      kind("time/absolute_single", "such times in single precision, and of another clock",
           {"mapped", "bad cloud"},
           [](PointCloud2& c, Dice& dice) {
             const bool single = dice.oneIn(2);
             const double start = single ? 1.7e9 : c.header.stamp.toSec() + 37.0;
             replaceField(c, "seconds", single ? PointField::FLOAT32 : PointField::FLOAT64,
                          [&] { return start + dice.between(0.0, 0.1); });
           }),
      kind("time/microseconds", "times in us as whole numbers",
           {"mapped", "bad cloud", "transform late", "too old"},
           [](PointCloud2& c, Dice& dice) {
             for (const char* name : {"ns", "seconds"}) {
               replaceField(c, name, PointField::UINT32, [&] { return std::floor(dice.between(0.0, 1e5)); });
             }
           }),
      kind("time/falling", "times that fall from point to point", {"mapped", "bad cloud"},
           [](PointCloud2& c, Dice&) {
             const auto points = static_cast<double>(pointsOf(c));
             for (std::size_t p = 0; p < pointsOf(c); ++p) {
               const double time = 0.1 * (1.0 - static_cast<double>(p) / points);
               put(c, "seconds", p, 0, time);
               put(c, "ns", p, 0, 1e9 * time);
             }
           }),
      kind("time/datatype", "times of another datatype", {"mapped", "bad cloud", "transform late", "too old"},
           [](PointCloud2& c, Dice& dice) {
             if (PointField* field = find(c, "seconds"))
               field->datatype = static_cast<std::uint8_t>(dice.below(9));
           }),
  };
}

std::vector<CloudKind> headerKinds() {
  const auto framed = [](const std::string& frame) {
    return [frame](PointCloud2& c, Dice&) { c.header.frame_id = frame; };
  };
  return {
      kind("header/stamp_0", "a stamp of 0", {"mapped", "transform late", "too old"},
           [](PointCloud2& c, Dice&) { c.header.stamp = ros::Time(); }),
      kind("header/stamp_future", "stamps of 1 s to 80 years ahead", {"transform late"},
           [](PointCloud2& c, Dice& dice) {
             c.header.stamp.sec = dice.oneOf<std::uint32_t>(
                 {c.header.stamp.sec + 1, c.header.stamp.sec + 50, kMax - 1, kMax, 1u << 31, (1u << 31) - 1});
           }),
      kind("header/stamp_other_clock", "stamps of TAI, of GPS, or of another time zone",
           {"transform late", "too old"},
           [](PointCloud2& c, Dice& dice) {
             c.header.stamp.sec =
                 static_cast<std::uint32_t>(c.header.stamp.sec + dice.oneOf<int>({37, 18, 7200, -37, -18}));
           }),
      kind("header/stamp_past", "stamps of 20 s and more ago", {"too old"},
           [](PointCloud2& c, Dice& dice) {
             c.header.stamp.sec = dice.oneOf<std::uint32_t>({c.header.stamp.sec - 20, 1, 0});
             c.header.stamp.nsec = 1;
           }),
      kind("header/stamp_not_normal", "more than 1e9 ns",
           {"mapped", "transform late", "too old", "no transform"},
           [](PointCloud2& c, Dice& dice) {
             c.header.stamp.nsec = dice.oneOf<std::uint32_t>({1000000000, 2000000000, kMax, kMax - 1});
             if (dice.oneIn(2)) c.header.stamp.sec = dice.oneOf<std::uint32_t>({0, kMax, kMax - 2});
           }),
      kind("header/frame_empty", "no frame", {"unknown frame"}, framed("")),
      kind("header/frame_unknown", "a frame that tf has never heard of", {"unknown frame"},
           framed("nowhere")),
      kind("header/frame_slash", "a frame that begins with a slash", {"mapped"}, framed("/honest_sensor")),
      kind("header/frame_slashes", "a frame that begins with two", {"unknown frame"},
           framed("//honest_sensor")),
      kind("header/frame_long", "a frame's name of 1 MB", {"unknown frame"},
           framed(std::string(1000000, 'f'))),
      kind("header/frame_not_utf8", "a frame's name that is not UTF-8, with zeros and line ends",
           {"unknown frame"}, framed(std::string("f\0\xff\xc0\n\033[2J%s", 10))),
      kind("header/frame_map", "the map frame", {"mapped"}, framed("map")),
  };
}

}  // namespace

const std::vector<CloudKind>& cloudKinds() {
  static const std::vector<CloudKind> kinds = [] {
    std::vector<CloudKind> all;
    for (const auto& part : {honestKinds(), sizeKinds(), fieldKinds(), cloudValueKinds(), labelKinds(),
                             cloudTimeKinds(), headerKinds()}) {
      all.insert(all.end(), part.begin(), part.end());
    }
    return all;
  }();
  return kinds;
}

PointCloud2 honestCloud(const std::string& frame, const ros::Time& stamp, Dice& dice) {
  PointCloud2 c;
  c.header.frame_id = frame;
  c.header.stamp = stamp;
  for (const std::string& axis : kCoordinates) addField(c, axis, PointField::FLOAT32, 1);
  addField(c, "label", PointField::UINT32, 1);
  addField(c, "rgb", PointField::UINT32, 1);
  addField(c, "scores", PointField::FLOAT32, 4);
  addField(c, "labels", PointField::UINT16, 3);
  addField(c, "label_scores", PointField::FLOAT32, 3);
  addField(c, "ns", PointField::UINT32, 1);
  addField(c, "seconds", PointField::FLOAT64, 1);
  c.height = dice.oneIn(2) ? 1 : static_cast<std::uint32_t>(2 + dice.below(15));
  c.width = static_cast<std::uint32_t>(
      1 + dice.below(c.height == 1 ? dice.oneOf<std::size_t>({1, 20, 60, 400}) : 24));
  c.row_step = c.point_step * c.width;
  c.data.resize(std::size_t{c.row_step} * c.height);
  constexpr std::uint32_t kColors[] = {0x000000, 0xdc3c3c, 0x3cb44b, 0x466ee6};
  const bool wall = dice.oneIn(2);
  const double reach = dice.oneOf<double>({2.0, 8.0, 15.0});
  for (std::size_t p = 0; p < pointsOf(c); ++p) {
    for (const std::string& axis : kCoordinates) put(c, axis, p, 0, dice.between(-reach, reach));
    if (wall) put(c, "x", p, 0, reach);
    const std::size_t label = dice.below(4);
    put(c, "label", p, 0, static_cast<double>(label));
    put(c, "rgb", p, 0, kColors[label]);
    for (std::uint32_t k = 0; k < 4; ++k) put(c, "scores", p, k, k == label ? 0.7 : 0.1);
    for (std::uint32_t k = 0; k < 3; ++k) {
      put(c, "labels", p, k, static_cast<double>((label + k) % 4));
      put(c, "label_scores", p, k, 0.7 - 0.3 * k);
    }
    const double time = 0.1 * static_cast<double>(p) / static_cast<double>(pointsOf(c));
    put(c, "ns", p, 0, 1e9 * time);
    put(c, "seconds", p, 0, time);
  }
  return c;
}

void swapBytes(PointCloud2& cloud) {
  for (const PointField& field : cloud.fields) {
    const std::size_t size = sizeOf(field.datatype);
    for (std::size_t p = 0; p < pointsOf(cloud); ++p) {
      for (std::size_t k = 0; k < field.count; ++k) {
        const std::size_t first = p * cloud.point_step + field.offset + k * size;
        if (first + size > cloud.data.size()) break;
        std::reverse(cloud.data.data() + first, cloud.data.data() + first + size);
      }
    }
  }
  cloud.is_bigendian = !cloud.is_bigendian;
}

void setAlpha(PointCloud2& cloud, Dice& dice) {
  const PointField* rgb = find(cloud, "rgb");
  if (!rgb) return;
  for (std::size_t p = 0; p < pointsOf(cloud); ++p) {
    const std::size_t highest = p * cloud.point_step + rgb->offset + (cloud.is_bigendian ? 0 : 3);
    if (highest < cloud.data.size()) cloud.data[highest] = dice.oneOf<std::uint8_t>({0x00, 0x7f, 0x80, 0xff});
  }
}

}  // namespace bki_mapping::hostile
