#include <map_msgs/OccupancyGridUpdate.h>
#include <nav_msgs/OccupancyGrid.h>

#include "columns.h"

namespace bki_mapping::ros_interface {
namespace {

/// Margin around the known cells, so that the grid does not grow with every scan [cells].
constexpr int kMargin = 16 * kBlockEdge;

/// The 2D map, sent like costmap_2d does: the whole grid when it grows, otherwise the changed rectangle.
class ProjectedMap : public ColumnPublisher {
 public:
  explicit ProjectedMap(const PublisherContext& context) {
    publisher_ = context.advertiseUpdates<nav_msgs::OccupancyGrid>(
        "projected_map", *this, [this](const auto& subscriber, const ServerSnapshot& snapshot) {
          bool all = false;
          look(snapshot, all);
          if (all) layOut(snapshot);
          if (!fits(grid_, 1)) return warnOfSize(grid_);
          subscriber.publish(whole(snapshot));
        });
    updates_ = context.advertiseUpdatesOf<map_msgs::OccupancyGridUpdate>("projected_map_updates", *this);
  }

  bool wanted() const override { return MapPublisher::wanted() || updates_.getNumSubscribers() > 0; }

 private:
  void publishNew(const ServerSnapshot& snapshot) override {
    bool all = false;
    const std::set<ColumnMap::StackIndex> stacks = look(snapshot, all);
    const bool inside =
        std::all_of(stacks.begin(), stacks.end(), [&](const auto& p) { return grid_.contains(p); });
    const bool anew = all || !inside || !fits(grid_, 1);
    if (anew) layOut(snapshot);
    if (!fits(grid_, 1)) return warnOfSize(grid_);
    if (anew || snapshot.config.full_projected_map) {
      publisher_.publish(whole(snapshot));
    } else if (!stacks.empty()) {
      updates_.publish(update(snapshot, around(stacks)));
    }
  }

  /// Makes the grid large enough for all known cells.
  void layOut(const ServerSnapshot& snapshot) {
    grid_ = everything();
    const bool grows = !snapshot.config.full_projected_map && grid_.width > 0;
    if (!grows) return;
    grid_.x -= kMargin;
    grid_.y -= kMargin;
    grid_.width += 2 * kMargin;
    grid_.height += 2 * kMargin;
  }

  std::vector<std::int8_t> cells(const CellRectangle& rectangle) const {
    std::vector<std::int8_t> data(std::size_t{rectangle.width} * rectangle.height,
                                  static_cast<std::int8_t>(ColumnView::Occupancy::kUnknown));
    forEachCell(rectangle, [&](std::size_t i, const ColumnView& view) { data[i] = view.cost; });
    return data;
  }

  nav_msgs::OccupancyGrid whole(const ServerSnapshot& snapshot) const {
    const double resolution = snapshot.map.geometry().resolution();
    nav_msgs::OccupancyGrid grid;
    grid.header = snapshot.header;
    grid.info.map_load_time = snapshot.header.stamp;
    grid.info.resolution = static_cast<float>(resolution);
    grid.info.origin.orientation.w = 1.0;
    grid.info.origin.position.x = grid_.x * resolution;
    grid.info.origin.position.y = grid_.y * resolution;
    grid.info.width = grid_.width;
    grid.info.height = grid_.height;
    grid.data = cells(grid_);
    return grid;
  }

  map_msgs::OccupancyGridUpdate update(const ServerSnapshot& snapshot, const CellRectangle& rectangle) const {
    map_msgs::OccupancyGridUpdate message;
    message.header = snapshot.header;
    message.x = rectangle.x - grid_.x;
    message.y = rectangle.y - grid_.y;
    message.width = rectangle.width;
    message.height = rectangle.height;
    message.data = cells(rectangle);
    return message;
  }

  ros::Publisher updates_;
  CellRectangle grid_;  ///< extent of the last message on projected_map
};

}  // namespace

std::unique_ptr<MapPublisher> makeProjectedMap(const PublisherContext& context) {
  return std::make_unique<ProjectedMap>(context);
}

}  // namespace bki_mapping::ros_interface
