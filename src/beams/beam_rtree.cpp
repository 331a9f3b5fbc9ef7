#define BOOST_ALLOW_DEPRECATED_HEADERS  // Boost 1.74 warns of its own use of old headers
#include <boost/geometry.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <boost/iterator/function_output_iterator.hpp>
#include <cmath>
#include <iterator>
#include <utility>

#include "beams/beam_index.h"

namespace bki_mapping {
namespace {

namespace bg = boost::geometry;
using Point = bg::model::point<float, 3, bg::cs::cartesian>;
using Box = bg::model::box<Point>;
using Value = std::pair<Point, std::uint32_t>;

/// See makeBeamRtree().
class BeamRtree : public BeamIndex {
 public:
  explicit BeamRtree(const std::vector<Eigen::Vector3f>& directions) {
    std::vector<Value> values;
    values.reserve(directions.size());
    for (const Eigen::Vector3f& u : directions) {
      values.emplace_back(Point(u.x(), u.y(), u.z()), static_cast<std::uint32_t>(values.size()));
    }
    tree_ = Tree(values);  // packed
  }

  void query(const Eigen::Vector3f& centre, float radius, std::vector<BeamRange>& ranges) const override {
    ranges.clear();
    const float distance = centre.norm();
    // Directions within the angle delta = asin(radius / distance) lie within the chord 2 sin(delta / 2).
    float half = 2.0f;
    if (distance > radius) half = 2.0f * std::sin(0.5f * std::asin(radius / distance)) + 1e-5f;
    const Eigen::Vector3f q =
        distance > radius ? Eigen::Vector3f(centre / distance) : Eigen::Vector3f::Zero();
    const Box box(Point(q.x() - half, q.y() - half, q.z() - half),
                  Point(q.x() + half, q.y() + half, q.z() + half));
    // An output iterator, since query iterators allocate memory.
    tree_.query(bg::index::intersects(box), boost::make_function_output_iterator([&](const Value& found) {
                  ranges.push_back({found.second, found.second + 1});
                }));
  }

 private:
  using Tree = bg::index::rtree<Value, bg::index::linear<16>>;
  Tree tree_;
};

}  // namespace

std::unique_ptr<BeamIndex> makeBeamRtree(const std::vector<Eigen::Vector3f>& directions) {
  return std::make_unique<BeamRtree>(directions);
}

}  // namespace bki_mapping
