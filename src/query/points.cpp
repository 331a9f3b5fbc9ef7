#include "bki_mapping/query/queries.h"

#include <algorithm>
#include <atomic>
#include <stdexcept>
#include <string>

namespace bki_mapping {
namespace {

constexpr std::size_t kPointsPerJob = 8192;  ///< some 100 us
/// Points whose blocks are fetched from memory at once. Too few, and the processor waits for memory; too
/// many, and the first are evicted before they are read.
constexpr std::size_t kBatch = 32;

/// Where a point's voxel is stored.
struct Place {
  const StateMap::RegionStates* region;
  BlockIndex block;
  int offset;
};

class PointReader {
 public:
  PointReader(const StateMap& states, const PointValues& values)
      : states_(states), map_(states.map()), reader_(states), values_(values) {
    wants_posterior_ = values.occupancy || values.class_probability || values.probability || values.variance;
    if (wants_posterior_) prior_ = viewWithoutEntropy(map_, states_.rules(), BlockIndex(), Block(), 0);
  }

  /// Reads points `begin` to `end` - 1, at most kBatch. @return false if one is not finite.
  template <typename Point>
  bool read(const Point* points, std::size_t begin, std::size_t end) {
    // In three steps, each of which prefetches what the next one reads.
    bool finite = true;
    for (std::size_t n = begin; n < end; ++n) {
      const Eigen::Vector3d point = points[n].template cast<double>();
      Place& place = places_[n - begin];
      place.region = nullptr;
      if (!map_.geometry().contains(point)) {
        finite = finite && point.allFinite();
        continue;
      }
      const VoxelIndex voxel = map_.geometry().voxelAt(point);
      place.block = GridGeometry::blockOf(voxel);
      place.offset = GridGeometry::offsetInBlock(voxel);
      place.region = reader_.region(place.block);
      if (place.region) place.region->prefetch(place.block);
    }
    const std::size_t count = end - begin;
    for (std::size_t n = 0; n < count; ++n) {
      const Place& place = places_[n];
      blocks_[n] = place.region ? place.region->find(states_, place.block) : nullptr;
      if (!blocks_[n]) continue;
      __builtin_prefetch(&blocks_[n]->layers[static_cast<std::size_t>(place.offset) / 64]);
      if (values_.labels) __builtin_prefetch(&blocks_[n]->labels[static_cast<std::size_t>(place.offset)]);
    }
    for (std::size_t n = 0; n < count; ++n) write(begin + n, blocks_[n], places_[n]);
    return finite;
  }

 private:
  void write(std::size_t n, const BlockStates* block, const Place& place) const {
    const int offset = place.offset;
    if (values_.states) values_.states[n] = block ? block->state(offset) : VoxelState::kUnknown;
    if (values_.labels) {
      values_.labels[n] = block ? block->labels[static_cast<std::size_t>(offset)] : kFreeClass;
    }
    if (!wants_posterior_) return;
    const VoxelView view =
        block ? viewWithoutEntropy(map_, states_.rules(), place.block, *block->block, offset) : prior_;
    if (values_.occupancy) values_.occupancy[n] = view.occupancy;
    if (values_.class_probability) values_.class_probability[n] = view.class_probability;
    if (values_.probability) values_.probability[n] = view.probability;
    if (values_.variance) values_.variance[n] = view.variance;
  }

  const StateMap& states_;
  const SemanticMap& map_;
  BlockReader reader_;
  PointValues values_;
  bool wants_posterior_;
  VoxelView prior_;  ///< of a voxel without evidence
  std::array<Place, kBatch> places_;
  std::array<const BlockStates*, kBatch> blocks_;
};

template <typename Point>
void readAny(const StateMap& states, Span<const Point> points, const PointValues& values) {
  std::atomic<std::size_t> bad_batch{points.size()};  // the first point of the first batch with a bad one
  states.parallelFor((points.size() + kPointsPerJob - 1) / kPointsPerJob, [&](std::size_t job) {
    PointReader reader(states, values);
    const std::size_t last = std::min(points.size(), (job + 1) * kPointsPerJob);
    for (std::size_t begin = job * kPointsPerJob; begin < last; begin += kBatch) {
      if (reader.read(points.data(), begin, std::min(last, begin + kBatch))) continue;
      for (std::size_t known = bad_batch; begin < known && !bad_batch.compare_exchange_weak(known, begin);) {
      }
    }
  });
  for (std::size_t n = bad_batch; n < points.size(); ++n) {
    if (points[n].allFinite()) continue;
    throw std::invalid_argument("point " + std::to_string(n) + " of " + std::to_string(points.size()) +
                                " has a coordinate that is not finite; remove such points");
  }
}

}  // namespace

void readPoints(const StateMap& states, Span<const Eigen::Vector3d> points, const PointValues& values) {
  readAny(states, points, values);
}

void readPoints(const StateMap& states, Span<const Eigen::Vector3f> points, const PointValues& values) {
  readAny(states, points, values);
}

}  // namespace bki_mapping
