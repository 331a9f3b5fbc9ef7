#include <bki_mapping/ElevationMap.h>

#include <limits>

#include "columns.h"

namespace bki_mapping::ros_interface {
namespace {

/// Publishes the ground and what is above it: the whole map first, then changed rectangles.
class Elevation : public ColumnPublisher {
 public:
  explicit Elevation(const PublisherContext& context) {
    publisher_ = context.advertiseUpdates<ElevationMap>(
        "elevation_map", *this, [this](const auto& subscriber, const ServerSnapshot& snapshot) {
          bool all = false;
          look(snapshot, all);
          const CellRectangle rectangle = everything();
          if (!fits(rectangle, kBytesACell)) return warnOfSize(rectangle);
          subscriber.publish(message(snapshot, rectangle, true));
        });
  }

 private:
  static constexpr std::size_t kBytesACell = 3 * sizeof(float) + 1;

  void publishNew(const ServerSnapshot& snapshot) override {
    bool all = false;
    const std::set<ColumnMap::StackIndex> stacks = look(snapshot, all);
    // Columns that were erased and new ones elsewhere may span a rectangle that does not fit.
    all = all || missed_ || !fits(around(stacks), kBytesACell);
    const CellRectangle rectangle = all ? everything() : around(stacks);
    missed_ = !fits(rectangle, kBytesACell);
    if (missed_) return warnOfSize(rectangle);
    ++sequence_;
    publisher_.publish(message(snapshot, rectangle, all));
  }

  ElevationMap message(const ServerSnapshot& snapshot, const CellRectangle& rectangle, bool whole) const {
    const std::size_t cells = std::size_t{rectangle.width} * rectangle.height;
    ElevationMap message;
    message.header = snapshot.header;
    message.sequence = sequence_;
    message.whole = whole;
    message.resolution = static_cast<float>(snapshot.map.geometry().resolution());
    message.x = rectangle.x;
    message.y = rectangle.y;
    message.width = rectangle.width;
    message.height = rectangle.height;
    const ColumnView unknown;
    message.ground_height.assign(cells, unknown.ground);
    message.ground_class.assign(cells, unknown.ground_class);
    message.clearance.assign(cells, unknown.clearance);
    message.occluded_height.assign(cells, unknown.occluded);
    forEachCell(rectangle, [&](std::size_t i, const ColumnView& view) {
      message.ground_height[i] = view.ground;
      message.ground_class[i] = view.ground_class;
      message.clearance[i] = view.clearance;
      message.occluded_height[i] = view.occluded;
    });
    return message;
  }

  std::uint64_t sequence_ = 0;
  bool missed_ = false;  ///< whether the last change was too large to be sent
};

}  // namespace

std::unique_ptr<MapPublisher> makeElevationMap(const PublisherContext& context) {
  return std::make_unique<Elevation>(context);
}

}  // namespace bki_mapping::ros_interface
