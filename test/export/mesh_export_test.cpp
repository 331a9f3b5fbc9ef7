// Meshes, read as glTF 2.0 says: their faces are the open faces of the occupied voxels, found one by one.
#include "export/mesh_export.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <tuple>
#include <vector>

#include "bki_mapping/rules/voxel_state.h"
#include "export/display_colors.h"
#include "export/open_faces.h"
#include "store/map_maker.h"
#include "temporary_folder.h"

namespace bki_mapping {
namespace {

using Json = nlohmann::json;

const StateRules kMeshRules = StateRules().withFreeGain(80, 0.1);

/// The centre of a face in half voxels from the map's origin, and where it looks.
using Place = std::tuple<std::int64_t, std::int64_t, std::int64_t, int, int, int>;

Place placeOf(const Eigen::Vector3d& centre, const Eigen::Vector3d& normal, double resolution) {
  const Eigen::Vector3d halves = centre / (0.5 * resolution);
  const auto whole = [](double value) { return static_cast<std::int64_t>(std::llround(value)); };
  return {whole(halves.x()),
          whole(halves.y()),
          whole(halves.z()),
          static_cast<int>(whole(normal.x())),
          static_cast<int>(whole(normal.y())),
          static_cast<int>(whole(normal.z()))};
}

/// A file, and its faces in the map frame.
class Mesh {
 public:
  explicit Mesh(const std::string& path, double resolution) : resolution_(resolution) {
    std::ifstream file(path, std::ios::binary);
    bytes_.assign(std::istreambuf_iterator<char>(file), {});
    EXPECT_EQ(bytes_.substr(0, 4), "glTF");
    EXPECT_EQ(word(4), 2u);
    EXPECT_EQ(word(8), bytes_.size());
    EXPECT_EQ(bytes_.substr(16, 4), "JSON");
    const std::size_t length = word(12);
    EXPECT_EQ(length % 4, 0u);
    json = Json::parse(bytes_.substr(20, length));
    binary_ = 20 + length;
    if (binary_ == bytes_.size()) return;
    EXPECT_EQ(word(binary_) + binary_ + 8, bytes_.size());
    EXPECT_EQ(bytes_.substr(binary_ + 4, 4), std::string("BIN\0", 4));
    binary_ += 8;
    EXPECT_EQ(json["buffers"][0]["byteLength"], bytes_.size() - binary_);
    const Json& node = json["nodes"][0];
    const auto& q = node["rotation"];
    const auto& t = node["translation"];
    pose_ = Eigen::Translation3d(t[0], t[1], t[2]) * Eigen::Quaterniond(q[3], q[0], q[1], q[2]);
    for (const Json& primitive : json["meshes"][node["mesh"].get<std::size_t>()]["primitives"]) {
      read(primitive);
    }
  }

  Json json;
  std::map<std::string, std::set<Place>> faces;  ///< by the name of the material
  std::size_t count = 0;

 private:
  std::uint32_t word(std::size_t at) const {
    std::uint32_t value = 0;
    std::memcpy(&value, bytes_.data() + at, 4);
    return value;
  }
  template <typename T>
  std::vector<T> array(const Json& accessor, const std::string& type, int component, std::size_t of_each) {
    EXPECT_EQ(accessor["type"], type);
    EXPECT_EQ(accessor["componentType"], component);
    const Json& view = json["bufferViews"][accessor["bufferView"].get<std::size_t>()];
    std::vector<T> values(accessor["count"].get<std::size_t>() * of_each);
    EXPECT_EQ(view["byteLength"], values.size() * sizeof(T));
    EXPECT_EQ(view["byteOffset"].get<std::size_t>() % 4, 0u);
    std::memcpy(values.data(), bytes_.data() + binary_ + view["byteOffset"].get<std::size_t>(),
                values.size() * sizeof(T));
    return values;
  }
  void read(const Json& primitive) {
    const Json& positions = json["accessors"][primitive["attributes"]["POSITION"].get<std::size_t>()];
    const auto places = array<float>(positions, "VEC3", 5126, 3);
    const auto triangles =
        array<std::uint32_t>(json["accessors"][primitive["indices"].get<std::size_t>()], "SCALAR", 5125, 1);
    // In the map frame, from glTF's, whose y axis points up.
    const Eigen::Quaterniond up(Eigen::AngleAxisd(std::acos(0.0), Eigen::Vector3d::UnitX()));
    std::vector<Eigen::Vector3d> corners;
    Eigen::AlignedBox3f box;
    for (std::size_t n = 0; n < places.size(); n += 3) {
      box.extend(Eigen::Vector3f(places[n], places[n + 1], places[n + 2]));
      corners.push_back(up * (pose_ * Eigen::Vector3d(places[n], places[n + 1], places[n + 2])));
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_EQ(positions["min"][axis].get<float>(), box.min()[static_cast<Eigen::Index>(axis)]);
      EXPECT_EQ(positions["max"][axis].get<float>(), box.max()[static_cast<Eigen::Index>(axis)]);
    }
    auto& of_material =
        faces[json["materials"][primitive["material"].get<std::size_t>()]["name"].get<std::string>()];
    for (std::size_t n = 0; n < triangles.size(); n += 6) {
      const auto at = [&](std::size_t i) { return corners.at(triangles.at(n + i)); };
      const Eigen::Vector3d first = (at(1) - at(0)).cross(at(2) - at(0));
      const Eigen::Vector3d second = (at(4) - at(3)).cross(at(5) - at(3));
      const double area = resolution_ * resolution_;
      EXPECT_NEAR(first.norm(), area, 1e-3 * area);
      EXPECT_LT((first - second).norm(), 1e-3 * area);
      const Place face = placeOf(0.25 * (at(0) + at(1) + at(2) + at(5)), first.normalized(), resolution_);
      of_material.insert(face);
      ++count;
    }
  }

  double resolution_;
  std::string bytes_;
  std::size_t binary_ = 0;
  Eigen::Affine3d pose_ = Eigen::Affine3d::Identity();
};

std::map<std::string, std::set<Place>> expectedFaces(const SemanticMap& map, const ClassTable& classes) {
  std::map<std::tuple<int, int, int>, ClassId> occupied;
  forEachKnownVoxel(map, kMeshRules, [&](const VoxelIndex& voxel, const VoxelView& view) {
    if (view.state == VoxelState::kOccupied) occupied[{voxel.x, voxel.y, voxel.z}] = view.label;
  });
  std::map<std::string, std::set<Place>> expected;
  for (const auto& [voxel, label] : occupied) {
    const auto [x, y, z] = voxel;
    for (int axis = 0; axis < 3; ++axis) {
      for (const int way : {-1, 1}) {
        const Eigen::Vector3i normal = way * Eigen::Vector3i::Unit(axis);
        if (occupied.count({x + normal.x(), y + normal.y(), z + normal.z()})) continue;
        const Eigen::Vector3d centre = map.geometry().voxelCentre({x, y, z});
        const double resolution = map.geometry().resolution();
        expected[classes.find(label)->name].insert(
            placeOf(centre + 0.5 * resolution * normal.cast<double>(), normal.cast<double>(), resolution));
      }
    }
  }
  return expected;
}

TEST(Mesh, HasTheOpenFacesOfEachClass) {
  const TemporaryFolder folder;
  const SemanticMap map = randomMap(4, 60, 3);
  const std::shared_ptr<const ClassTable> table = infoOf().classes;
  const ClassTable& classes = *table;
  exportMesh(folder / "map.glb", map, kMeshRules, classes);
  const Mesh mesh(folder / "map.glb", map.geometry().resolution());
  const auto expected = expectedFaces(map, classes);
  EXPECT_GT(expected.size(), 1u);
  EXPECT_EQ(mesh.faces, expected);
  std::size_t count = 0;
  for (const auto& [name, faces] : expected) count += faces.size();
  EXPECT_GT(count, 10000u);
  EXPECT_EQ(mesh.count, count) << "faces occur twice";
}

TEST(Mesh, HasTheColoursOfTheClassesAsLight) {
  const TemporaryFolder folder;
  exportMesh(folder / "map.glb", randomMap(4, 60, 3), kMeshRules, *infoOf().classes);
  const Mesh mesh(folder / "map.glb", 0.3);
  for (const Json& material : mesh.json["materials"]) {
    const Json& color = material["pbrMetallicRoughness"]["baseColorFactor"];
    EXPECT_NEAR(color[1].get<double>(), 0.21586, 1e-5);  // 128 of 255 in sRGB
    EXPECT_EQ(color[2].get<double>(), 1.0);
  }
}

TEST(Mesh, StandsFarFromTheOriginAsExactlyAsNearIt) {
  const TemporaryFolder folder;
  const std::vector<EvidenceUnits> plane(kBlockVoxels, 900);
  SemanticMap map = infoOf().emptyMap();
  map.getOrAllocate({{208333, 1666666, 3}}).add(40, plane.data());  // 500 km east, 4,000 km north
  exportMesh(folder / "map.glb", map, kMeshRules, *infoOf().classes);
  const Mesh mesh(folder / "map.glb", map.geometry().resolution());
  EXPECT_EQ(mesh.faces, expectedFaces(map, *infoOf().classes));
  EXPECT_EQ(mesh.count, 6u * 64u);
}

/// The faces of a .ply, as read by PLY's own rules; each is given by its colour.
std::map<Color, std::multiset<Place>> facesOfPly(const std::string& path, double resolution) {
  std::ifstream file(path, std::ios::binary);
  std::size_t corners = 0, triangles = 0;
  bool doubles = false;
  for (std::string line; std::getline(file, line) && line != "end_header";) {
    std::sscanf(line.c_str(), "element vertex %zu", &corners);
    std::sscanf(line.c_str(), "element face %zu", &triangles);
    doubles = doubles || line == "property double x";
  }
  std::vector<Eigen::Vector3d> places;
  for (std::size_t n = 0; n < corners; ++n) {
    Eigen::Vector3d exact;
    Eigen::Vector3f rounded;
    if (doubles) file.read(reinterpret_cast<char*>(exact.data()), sizeof exact);
    if (!doubles) file.read(reinterpret_cast<char*>(rounded.data()), sizeof rounded);
    places.push_back(doubles ? exact : rounded.cast<double>());
  }
  std::map<Color, std::multiset<Place>> faces;
  for (std::size_t n = 0; n < triangles; n += 2) {
    std::array<std::array<std::uint32_t, 3>, 2> pair{};
    Color color{};
    for (auto& numbers : pair) {
      EXPECT_EQ(file.get(), 3);
      file.read(reinterpret_cast<char*>(numbers.data()), sizeof numbers);
      file.read(reinterpret_cast<char*>(color.data()), sizeof color);
    }
    const auto at = [&](std::size_t i, std::size_t j) { return places.at(pair[i][j]); };
    const Eigen::Vector3d normal = (at(0, 1) - at(0, 0)).cross(at(0, 2) - at(0, 0)).normalized();
    faces[color].insert(placeOf(0.25 * (at(0, 0) + at(0, 1) + at(0, 2) + at(1, 2)), normal, resolution));
  }
  EXPECT_EQ(file.get(), std::ifstream::traits_type::eof());
  return faces;
}

TEST(Mesh, HasTheSameFacesInAPlyFile) {
  const TemporaryFolder folder;
  const std::shared_ptr<const ClassTable> table = infoOf().classes;
  SemanticMap far = infoOf().emptyMap();
  far.getOrAllocate({{208333, 1666666, 3}}).add(40, std::vector<EvidenceUnits>(kBlockVoxels, 900).data());
  const SemanticMap near = randomMap(4, 60, 3);
  for (const SemanticMap* const map : std::initializer_list<const SemanticMap*>{&near, &far}) {
    exportMesh(folder / "map.ply", *map, kMeshRules, *table);
    std::map<Color, std::multiset<Place>> expected;
    for (const auto& [name, faces] : expectedFaces(*map, *table)) {
      for (const SemanticClass& c : table->classes()) {
        if (c.name == name) expected[c.color] = {faces.begin(), faces.end()};
      }
    }
    EXPECT_EQ(facesOfPly(folder / "map.ply", map->geometry().resolution()), expected);
  }
}

TEST(Mesh, EndsInGlbOrPly) {
  for (const char* const name : {"map.obj", "map.pcd", "map", "map.glb.bkm"}) {
    EXPECT_THROW(checkMeshName(name), std::invalid_argument) << name;
  }
}

TEST(Mesh, OfAnEmptyMapIsAnEmptyScene) {
  const TemporaryFolder folder;
  exportMesh(folder / "map.glb", infoOf().emptyMap(), kMeshRules, *infoOf().classes);
  const Mesh mesh(folder / "map.glb", 0.3);
  EXPECT_EQ(mesh.json["scenes"][0]["nodes"], Json({0}));
  EXPECT_FALSE(mesh.json["nodes"][0].contains("mesh"));
  EXPECT_FALSE(mesh.json.contains("buffers"));  // glTF allows no empty ones
}

TEST(Mesh, TooLargeIsNoticedBeforeItIsWritten) {
  EXPECT_THROW(openFaces(randomMap(4, 60, 3), kMeshRules, Eigen::Vector3d::Zero(), 1000), std::length_error);
}

}  // namespace
}  // namespace bki_mapping
