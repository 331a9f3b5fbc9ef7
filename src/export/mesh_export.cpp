#include "export/mesh_export.h"

#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <stdexcept>
#include <vector>

#include "core/atomic_file.h"
#include "core/float_origin.h"
#include "export/display_colors.h"
#include "export/open_faces.h"
#include "export/ordered_json.h"
#include "export/voxel_points.h"

namespace bki_mapping {
namespace {

using Json = OrderedJson;
using FacesByClass = std::map<ClassId, Faces>;

Color colorOf(ClassId id, const ClassTable& classes) {
  return semanticColor(VoxelState::kOccupied, id, classes);
}

/// A component of a colour of the screen (sRGB, IEC 61966-2-1) as the light that it stands for, 0 to 1.
double light(std::uint8_t component) {
  const double c = component / 255.0;
  return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
}

Json materialOf(ClassId id, const ClassTable& classes) {
  const SemanticClass* const known = classes.find(id);
  const Color color = colorOf(id, classes);
  return {{"name", known ? known->name : "class " + std::to_string(id)},
          {"pbrMetallicRoughness",
           {{"baseColorFactor", {light(color[0]), light(color[1]), light(color[2]), 1.0}},
            {"metallicFactor", 0.0},
            {"roughnessFactor", 1.0}}}};
}

Json coordinates(const Eigen::Vector3f& place) {
  return {place.x(), place.y(), place.z()};
}

/// The file's text, and the order of its bytes: corners and triangles of one class after the other.
Json descriptionOf(const FacesByClass& all, const ClassTable& classes, const Eigen::Vector3d& origin) {
  constexpr int kFloat = 5126, kUnsignedInt = 5125, kArrayBuffer = 34962, kElementArrayBuffer = 34963;
  const double half = std::sqrt(0.5);
  Json node = {{"name", "map"},
               {"rotation", {-half, 0.0, 0.0, half}},  // z up in the map, y up in glTF
               {"translation", {origin.x(), origin.z(), -origin.y()}}};
  Json gltf = {{"asset", {{"version", "2.0"}, {"generator", "bki_mapping"}}}, {"scene", 0}};
  gltf["scenes"] = Json::array({{{"nodes", {0}}}});
  if (!all.empty()) {
    node["mesh"] = 0;
    Json views = Json::array(), accessors = Json::array(), primitives = Json::array(),
         materials = Json::array();
    std::uint64_t offset = 0;
    const auto addView = [&](std::uint64_t bytes, int target) {
      views.push_back({{"buffer", 0}, {"byteOffset", offset}, {"byteLength", bytes}, {"target", target}});
      offset += bytes;
      return views.size() - 1;
    };
    for (const auto& [id, faces] : all) {
      accessors.push_back(
          {{"bufferView", addView(sizeof(Eigen::Vector3f) * faces.corners.size(), kArrayBuffer)},
           {"componentType", kFloat},
           {"count", faces.corners.size()},
           {"type", "VEC3"},
           {"min", coordinates(faces.box.min())},
           {"max", coordinates(faces.box.max())}});
      accessors.push_back(
          {{"bufferView", addView(sizeof(std::uint32_t) * faces.triangles.size(), kElementArrayBuffer)},
           {"componentType", kUnsignedInt},
           {"count", faces.triangles.size()},
           {"type", "SCALAR"}});
      primitives.push_back({{"attributes", {{"POSITION", accessors.size() - 2}}},
                            {"indices", accessors.size() - 1},
                            {"material", materials.size()}});
      materials.push_back(materialOf(id, classes));
    }
    gltf["meshes"] = Json::array({{{"name", "map"}, {"primitives", primitives}}});
    gltf["materials"] = materials;
    gltf["accessors"] = accessors;
    gltf["bufferViews"] = views;
    gltf["buffers"] = Json::array({{{"byteLength", offset}}});
  }
  gltf["nodes"] = Json::array({node});
  return gltf;
}

template <typename T>
std::string bytesOf(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), sizeof(T) * values.size()};
}

std::string word(std::uint64_t value) {
  std::string bytes(4, '\0');
  for (std::size_t n = 0; n < 4; ++n) bytes[n] = static_cast<char>(value >> 8 * n & 0xff);
  return bytes;
}

std::uint64_t bytesOf(const FacesByClass& all) {
  std::uint64_t bytes = 0;
  for (const auto& [id, faces] : all) bytes += faces.bytes();
  return bytes;
}

void writeGlb(const FacesByClass& all, const ClassTable& classes, const Eigen::Vector3d& origin,
              AtomicFile& file) {
  std::string text = descriptionOf(all, classes, origin).dump(-1, ' ', false, Json::error_handler_t::replace);
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const std::uint64_t bytes = bytesOf(all);
  constexpr std::uint64_t kHeader = 12, kChunkHeader = 8;
  const std::uint64_t chunks = bytes > 0 ? 2 : 1;
  file.write("glTF" + word(2) + word(kHeader + chunks * kChunkHeader + text.size() + bytes));
  file.write(word(text.size()) + "JSON" + text);
  if (bytes > 0) file.write(word(bytes) + std::string("BIN\0", 4));
  for (const auto& [id, faces] : all) {
    file.write(bytesOf(faces.corners));
    file.write(bytesOf(faces.triangles));
  }
}

/// Corners of all classes, and then triangles, each with the colour of its class.
void writePly(const FacesByClass& all, const ClassTable& classes, const Eigen::Vector3d& origin,
              AtomicFile& file) {
  std::size_t corners = 0, triangles = 0;
  for (const auto& [id, faces] : all) {
    corners += faces.corners.size();
    triangles += faces.triangles.size() / 3;
  }
  const bool far = !origin.isZero(0.0);
  const std::string number = far ? "double" : "float";
  file.write("ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(corners) +
             "\nproperty " + number + " x\nproperty " + number + " y\nproperty " + number +
             " z\nelement face " + std::to_string(triangles) +
             "\nproperty list uchar uint vertex_indices\nproperty uchar red\nproperty uchar green\n"
             "property uchar blue\nend_header\n");
  for (const auto& [id, faces] : all) {
    if (!far) {
      file.write(bytesOf(faces.corners));
      continue;
    }
    std::vector<Eigen::Vector3d> exact;
    exact.reserve(faces.corners.size());
    for (const Eigen::Vector3f& corner : faces.corners) exact.push_back(origin + corner.cast<double>());
    file.write(bytesOf(exact));
  }
  std::uint64_t before = 0;
  for (const auto& [id, faces] : all) {
    const Color color = colorOf(id, classes);
    std::string rows;
    rows.reserve(faces.triangles.size() / 3 * 16);
    for (std::size_t n = 0; n < faces.triangles.size(); ++n) {
      if (n % 3 == 0) rows += '\3';
      rows += word(before + faces.triangles[n]);
      if (n % 3 == 2) rows.append(color.begin(), color.end());
    }
    file.write(rows);
    before += faces.corners.size();
  }
}

using Write = void (*)(const FacesByClass&, const ClassTable&, const Eigen::Vector3d&, AtomicFile&);
Write writeOf(const std::string& path) {
  const std::string ending = std::filesystem::path(path).extension().string();
  if (ending == ".glb") return writeGlb;
  if (ending == ".ply") return writePly;
  throw std::invalid_argument("mesh '" + path + "' must end in .glb or .ply");
}

}  // namespace

void checkMeshName(const std::string& path) {
  writeOf(path);
}

void exportMesh(const std::string& path, const SemanticMap& map, const StateRules& rules,
                const ClassTable& classes) {
  const Write write = writeOf(path);
  const Eigen::Vector3d origin =
      floatOrigin(placeOf(map.geometry(), sortedBlocks(map)), map.geometry().resolution());
  constexpr std::uint64_t kMost = std::numeric_limits<std::uint32_t>::max(), kText = 1u << 20;
  FacesByClass all;
  try {
    all = openFaces(map, rules, origin, kMost - kText);
  } catch (const std::length_error&) {
    throw std::invalid_argument(
        path +
        ": the faces take more than the 4 GB that a mesh can hold; export a part of the map "
        "(export_map --box)");
  }
  AtomicFile file(path);
  write(all, classes, origin, file);
  file.commit();
}

}  // namespace bki_mapping
