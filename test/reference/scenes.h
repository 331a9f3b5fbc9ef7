/// @file Small scenes for tests, most of them edge cases.
#pragma once

#include <memory>
#include <random>
#include <string>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/scan.h"

namespace bki_mapping::reference {

/// Classes 0 to 3; class c has the raw label 10 c, and class 0 is unlabelled.
inline std::shared_ptr<const ClassTable> smallTable() {
  std::vector<SemanticClass> classes(4);
  for (std::uint8_t id = 0; id < 4; ++id) {
    classes[id].id = id;
    classes[id].name = "class" + std::to_string(id);
    classes[id].raw = {10u * id};
  }
  classes[0].unlabelled = true;
  return std::make_shared<ClassTable>("small", classes);
}

/// The same, but the last class can move, and class 1 is ground.
inline std::shared_ptr<const ClassTable> tableWithDynamicClass() {
  std::vector<SemanticClass> classes = smallTable()->classes();
  classes.back().dynamic = true;
  classes[1].ground = true;
  return std::make_shared<ClassTable>("dynamic", classes);
}

struct Scene {
  std::string name;
  Scan scan;
};

/// A scan of `count` hits; direction and distance of each are drawn by `draw(random)`.
template <typename Draw>
Scene makeScene(const std::string& name, const Eigen::Vector3d& origin, int count, unsigned seed,
                Draw&& draw) {
  Scene scene{name, {}};
  scene.scan.origin = origin;
  scene.scan.stamp = 1000u + seed;
  std::mt19937 random(seed);
  for (int i = 0; i < count; ++i) {
    scene.scan.points.push_back(draw(random).template cast<float>());
    scene.scan.labels.push_back(10u * static_cast<unsigned>(random() % 4u));
  }
  return scene;
}

/// Scenes that cover all directions, the azimuth seam, both poles, beams along the axes, a dense cluster of
/// hits, hits about the sensor, and an origin far from zero.
inline std::vector<Scene> nastyScenes(int count = 120) {
  const auto uniform = [](std::mt19937& r, double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(r);
  };
  const auto inBox = [=](std::mt19937& r, double edge) {
    // One after another: compilers differ in the order in which they evaluate arguments.
    const double z = uniform(r, -edge, edge), y = uniform(r, -edge, edge), x = uniform(r, -edge, edge);
    return Eigen::Vector3d(x, y, z);
  };
  std::vector<Scene> scenes;
  scenes.push_back(
      makeScene("everywhere", {0.03, -0.07, 0.11}, count, 1, [&](std::mt19937& r) { return inBox(r, 3.0); }));
  scenes.push_back(makeScene("seam", {1.0, 2.0, 0.5}, count, 2, [&](std::mt19937& r) {
    const double z = uniform(r, -0.5, 0.5), y = uniform(r, -0.3, 0.3), x = uniform(r, -4.0, -0.5);
    return Eigen::Vector3d(x, y, z);
  }));
  scenes.push_back(makeScene("poles", {-0.4, 0.2, -0.1}, count, 3, [&](std::mt19937& r) {
    const double z = uniform(r, 0.5, 4.0);
    const double up_or_down = r() % 2 ? z : -z, y = uniform(r, -0.4, 0.4), x = uniform(r, -0.4, 0.4);
    return Eigen::Vector3d(x, y, up_or_down);
  }));
  scenes.push_back(makeScene("axes", {0.013, 0.027, -0.031}, count / 2, 4, [&](std::mt19937& r) {
    Eigen::Vector3d p = Eigen::Vector3d::Zero();
    p[r() % 3] = uniform(r, -4.0, 4.0);
    return p;
  }));
  scenes.push_back(makeScene("cluster", {5.01, 0.0, 1.0}, count, 5, [&](std::mt19937& r) {
    const Eigen::Vector3d offset = inBox(r, 0.25);
    return Eigen::Vector3d(offset.x() - 3.0, offset.y() + 0.4, offset.z() - 0.8);
  }));
  scenes.push_back(makeScene("near the sensor", {0.1, 0.1, 0.1}, count, 6,
                             [&](std::mt19937& r) { return inBox(r, 0.4); }));
  scenes.push_back(makeScene("far from zero", {500000.3, -4000000.7, 120.1}, count, 7,
                             [&](std::mt19937& r) { return inBox(r, 3.0); }));
  return scenes;
}

}  // namespace bki_mapping::reference
