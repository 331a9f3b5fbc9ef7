#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "bki_mapping/rules/voxel_state.h"
#include "core/float_origin.h"
#include "export/display_colors.h"
#include "ros/map_publisher.h"
#include "streamed_markers.h"

namespace bki_mapping::ros_interface {
namespace {

std_msgs::ColorRGBA rgba(const Color& color, float alpha) {
  std_msgs::ColorRGBA c;
  c.r = static_cast<float>(color[0]) / 255.0f;
  c.g = static_cast<float>(color[1]) / 255.0f;
  c.b = static_cast<float>(color[2]) / 255.0f;
  c.a = alpha;
  return c;
}

/// A rainbow from blue through green to red for values from 0 to 1.
Color rainbow(double value) {
  const double v = std::clamp(value, 0.0, 1.0);
  const auto channel = [&](double peak) {
    return static_cast<std::uint8_t>(255.0 * std::clamp(1.5 - std::abs(4.0 * v - peak), 0.0, 1.0));
  };
  return {channel(3.0), channel(2.0), channel(1.0)};
}

/// Position in the colour scale of heights, which repeats every 20 m.
double heightFraction(double z) {
  return z / 20.0 - std::floor(z / 20.0);
}

/// The colour of a voxel of a block. @param z height of its centre [m].
Color colorOf(const BlockView& view, std::size_t v, double z, ColorMode mode, const ClassTable& classes) {
  switch (mode) {
    case ColorMode::kProbability:
      return rainbow(view.probability[v]);
    case ColorMode::kVariance:
      return rainbow(4.0 * view.variance[v]);  // p (1 - p) is at most 1/4
    case ColorMode::kHeight:
      return rainbow(heightFraction(z));
    default:
      return semanticColor(view.state[v], view.label[v], classes);
  }
}

/// The fields of a BlockView that colorOf reads.
BlockFields fieldsOf(ColorMode mode) {
  const bool numbers = mode == ColorMode::kProbability || mode == ColorMode::kVariance;
  return numbers ? BlockFields::kAllButEntropy : BlockFields::kStates;
}

constexpr int kRegionEdge = Region::kEdge;

/// Marker arrays with one CUBE_LIST per class and region of the map: its namespace is the class's name, its
/// id that of the region. Only changed regions are sent; a marker that became empty is deleted.
class CellMarkers : public MapPublisher {
 public:
  using Marker = visualization_msgs::Marker;

  CellMarkers(const PublisherContext& context, const std::string& topic, VoxelState state, float alpha)
      : state_(state), alpha_(alpha) {
    publisher_ = context.advertiseUpdates<StreamedMarkers>(
        topic, *this, [this](const auto& subscriber, const ServerSnapshot& snapshot) {
          subscriber.publish(whole(snapshot));
        });
  }

  void rest() override {
    MapPublisher::rest();
    regions_.clear();
    free_ids_.clear();
  }

 private:
  /// A region in which the map holds at least one block.
  struct Region {
    std::int32_t id;
    bool in_view = false;
    std::set<ClassId> shown;  ///< classes whose markers the subscribers hold
  };
  using Regions = std::map<GridIndex, Region>;

  void publishNew(const ServerSnapshot& snapshot) override {
    if (changed.all()) {
      publisher_.publish(whole(snapshot));
      return;
    }
    IndexNumbering regions;
    for (const GridIndex& block : changed.blocks()) regions.insert(SemanticMap::regionOf({block}));
    for (const auto& [index, region] : regions_) {  // the view moves with the sensor
      if (inView(index, snapshot) != region.in_view) regions.insert(index);
    }
    StreamedMarkers message;
    appendRegions(regions.members(), snapshot, message);
    forgetEmpty(regions.members(), snapshot);
    if (message.markers.count() > 0) publisher_.publish(message);
  }

  /// A message that must not outlive the snapshot.
  StreamedMarkers whole(const ServerSnapshot& snapshot) {
    StreamedMarker clear;
    clear.frame.header = snapshot.header;
    clear.frame.action = Marker::DELETEALL;
    clear.frame.pose.orientation.w = 1.0;
    StreamedMarkers message;
    message.markers.groups.push_back({{clear}, nullptr});
    for (const auto& entry : snapshot.map.entries()) regionAt(SemanticMap::regionOf(entry.index));
    std::vector<GridIndex> indices;
    for (auto& [index, region] : regions_) {
      region.shown.clear();
      indices.push_back(index);
    }
    appendRegions(indices, snapshot, message);
    forgetEmpty(indices, snapshot);
    return message;
  }

  /// Finds a region, or creates it with an id that none of the subscribers' markers has.
  Regions::iterator regionAt(const GridIndex& index) {
    const auto known = regions_.find(index);
    if (known != regions_.end()) return known;
    auto id = static_cast<std::int32_t>(regions_.size());  // without free ids, 0 to size - 1 are in use
    if (!free_ids_.empty()) {
      id = free_ids_.back();
      free_ids_.pop_back();
    }
    return regions_.emplace(index, Region{id, false, {}}).first;
  }

  /// Forgets regions without a block and frees their ids. To be called after the message is complete: it
  /// still deletes the markers with these ids, so that only the next message may use them again.
  void forgetEmpty(const std::vector<GridIndex>& indices, const ServerSnapshot& snapshot) {
    for (const GridIndex& index : indices) {
      bool any = false;
      for (int n = 0; n < kRegionEdge * kRegionEdge * kRegionEdge && !any; ++n) {
        any = snapshot.map.find({GridGeometry::voxelOf({index}, n)});
      }
      if (any) continue;
      free_ids_.push_back(regions_.at(index).id);
      regions_.erase(index);
    }
  }

  static double edgeOf(const ServerSnapshot& snapshot) {
    return kRegionEdge * snapshot.map.geometry().blockSize();
  }
  static Eigen::Vector3d centreOf(const GridIndex& region, const ServerSnapshot& snapshot) {
    return Eigen::Vector3d(region.x + 0.5, region.y + 0.5, region.z + 0.5) * edgeOf(snapshot);
  }
  bool inView(const GridIndex& region, const ServerSnapshot& snapshot) const {
    return snapshot.inView(centreOf(region, snapshot), edgeOf(snapshot));
  }

  /// Appends the markers of regions. Several threads count their voxels.
  void appendRegions(const std::vector<GridIndex>& indices, const ServerSnapshot& snapshot,
                     StreamedMarkers& message) {
    MarkerGroups& appended = message.markers;
    std::vector<Region*> regions;
    for (const GridIndex& index : indices) {
      regions.push_back(&regionAt(index)->second);
      regions.back()->in_view = inView(index, snapshot);
    }
    std::vector<Cells> cells(indices.size());
    constexpr std::size_t kBlocks = 64;  // of a street, in a region; there is room for 512
    appended.threads = snapshot.threadsFor(kBlocks * indices.size());
    ThreadPool pool(appended.threads);
    pool.forEachInOrder(indices.size(), [&](std::size_t r, std::size_t) {
      cells[r].origin = floatOrigin(centreOf(indices[r], snapshot), snapshot.map.geometry().resolution());
      if (regions[r]->in_view) count(indices[r], snapshot, cells[r]);
    });
    for (std::size_t r = 0; r < indices.size(); ++r) {
      MarkerGroup markers = markersOf(std::move(cells[r]), snapshot, *regions[r]);
      if (!markers.markers.empty()) appended.groups.push_back(std::move(markers));
    }
  }

  /// Calls visit(offset, z) for the voxels of a block that are shown.
  template <typename Visit>
  void forEachShown(const BlockIndex& index, const BlockView& view, const ServerSnapshot& snapshot,
                    const Visit& visit) const {
    const double edge = snapshot.map.geometry().resolution();
    constexpr std::size_t kLayer = kBlockEdge * kBlockEdge;
    for (std::size_t layer = 0; layer < kBlockEdge; ++layer) {
      const double z = (index.z * kBlockEdge + static_cast<int>(layer) + 0.5) * edge;
      if (!snapshot.heightInView(z)) continue;
      for (std::size_t v = layer * kLayer; v < (layer + 1) * kLayer; ++v) {
        if (view.state[v] == state_) visit(v, z);
      }
    }
  }

  /// What a region shows.
  struct Cells {
    Eigen::Vector3d origin;  ///< of the markers' points: rviz rounds them to float32 [m]
    std::vector<std::pair<BlockIndex, const Block*>> blocks;
    std::array<std::uint32_t, 256> of_label{};  ///< number of voxels
  };

  void count(const GridIndex& region, const ServerSnapshot& snapshot, Cells& cells) const {
    BlockView view;
    for (int n = 0; n < kRegionEdge * kRegionEdge * kRegionEdge; ++n) {
      const BlockIndex index{GridGeometry::voxelOf({region}, n)};
      const Block* block = snapshot.map.find(index);
      if (!block) continue;
      readBlock(snapshot.map, snapshot.rules, index, *block, BlockFields::kStates, view);
      bool any = false;
      forEachShown(index, view, snapshot, [&](std::size_t v, double) {
        ++cells.of_label[view.label[v]];
        any = true;
      });
      if (any) cells.blocks.emplace_back(index, block);
    }
  }

  /// The markers of a region, and the deletion of those that have become empty.
  MarkerGroup markersOf(Cells cells, const ServerSnapshot& snapshot, Region& region) const {
    MarkerGroup group;
    const auto append = [&](ClassId label, std::int32_t action) {
      group.markers.push_back({emptyMarker(snapshot, label, cells.origin), cells.of_label[label]});
      group.markers.back().frame.id = region.id;
      group.markers.back().frame.action = action;
    };
    const std::set<ClassId> before = std::move(region.shown);
    region.shown.clear();
    for (const ClassId gone : before) {
      if (cells.of_label[gone] == 0) append(gone, Marker::DELETE);
    }
    const std::size_t deleted = group.markers.size();
    for (std::size_t label = 0; label < cells.of_label.size(); ++label) {
      if (cells.of_label[label] == 0) continue;
      append(static_cast<ClassId>(label), Marker::ADD);
      region.shown.insert(static_cast<ClassId>(label));
    }
    group.write = [this, deleted, &snapshot, cells = std::move(cells)](std::vector<CubeWriter>& writers) {
      std::array<CubeWriter*, 256> of_label{};
      std::size_t number = deleted;
      for (std::size_t label = 0; label < of_label.size(); ++label) {
        if (cells.of_label[label] > 0) of_label[label] = &writers[number++];
      }
      for (const auto& [index, block] : cells.blocks) {
        writeCubes(index, *block, snapshot, cells.origin, of_label);
      }
    };
    return group;
  }

  void writeCubes(const BlockIndex& index, const Block& block, const ServerSnapshot& snapshot,
                  const Eigen::Vector3d& origin, const std::array<CubeWriter*, 256>& of_label) const {
    const ColorMode mode = snapshot.config.color_mode;
    const double edge = snapshot.map.geometry().resolution();
    BlockView view;
    readBlock(snapshot.map, snapshot.rules, index, block, fieldsOf(mode), view);
    double x[kBlockEdge], y[kBlockEdge];
    for (int n = 0; n < kBlockEdge; ++n) {
      x[n] = (index.x * kBlockEdge + n + 0.5) * edge - origin.x();
      y[n] = (index.y * kBlockEdge + n + 0.5) * edge - origin.y();
    }
    forEachShown(index, view, snapshot, [&](std::size_t v, double z) {
      of_label[view.label[v]]->add({x[v % kBlockEdge], y[v / kBlockEdge % kBlockEdge], z - origin.z()},
                                   rgba(colorOf(view, v, z, mode, snapshot.classes), alpha_));
    });
  }

  Marker emptyMarker(const ServerSnapshot& snapshot, ClassId label, const Eigen::Vector3d& origin) const {
    const SemanticClass* known = snapshot.classes.find(label);
    Marker marker;
    marker.header = snapshot.header;
    marker.ns = known ? known->name : "free";
    marker.type = Marker::CUBE_LIST;
    marker.pose.position.x = origin.x();
    marker.pose.position.y = origin.y();
    marker.pose.position.z = origin.z();
    marker.pose.orientation.w = 1.0;
    const double edge = snapshot.map.geometry().resolution();
    marker.scale.x = marker.scale.y = marker.scale.z = edge;
    marker.color.a = alpha_;
    return marker;
  }

  VoxelState state_;
  float alpha_;
  Regions regions_;                     ///< whose markers the subscribers hold
  std::vector<std::int32_t> free_ids_;  ///< smaller than the largest id in use
};

}  // namespace

std::unique_ptr<MapPublisher> makeOccupiedCells(const PublisherContext& context) {
  return std::make_unique<CellMarkers>(context, "occupied_cells_vis_array", VoxelState::kOccupied, 1.0f);
}

std::unique_ptr<MapPublisher> makeFreeCells(const PublisherContext& context) {
  return std::make_unique<CellMarkers>(context, "free_cells_vis_array", VoxelState::kFree, 0.1f);
}

}  // namespace bki_mapping::ros_interface
