/// @file The layer of costmap_2d that follows the mapper. Built only where costmap_2d is.
#include <costmap_2d/GenericPluginConfig.h>
#include <costmap_2d/layer.h>
#include <costmap_2d/layered_costmap.h>
#include <dynamic_reconfigure/server.h>
#include <ros/ros.h>
#include <tf2/LinearMath/Matrix3x3.h>
#include <tf2_ros/buffer.h>
#include <pluginlib/class_list_macros.hpp>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

#include "costmap/grid_copy.h"

namespace bki_mapping::costmap {
namespace {

Affine planeOf(const geometry_msgs::Transform& transform) {
  const auto& q = transform.rotation;
  const tf2::Matrix3x3 r(tf2::Quaternion(q.x, q.y, q.z, q.w));
  const auto& t = transform.translation;
  return {r[0][0], r[0][1], t.x, r[1][0], r[1][1], t.y};
}

/// Undoes a map; nullopt of one that folds the plane, such as a view from the side.
std::optional<Affine> inverse(const Affine& a) {
  const double determinant = a.xx * a.yy - a.xy * a.yx;
  if (!(std::abs(determinant) > 1e-3)) return std::nullopt;
  Affine b{a.yy / determinant, -a.xy / determinant, 0, -a.yx / determinant, a.xx / determinant, 0};
  b.x = -(b.xx * a.x + b.xy * a.y);
  b.y = -(b.yx * a.x + b.yy * a.y);
  return b;
}

}  // namespace

class SemanticLayer : public costmap_2d::Layer {
 public:
  void onInitialize() override {
    ros::NodeHandle node("~/" + name_);
    node.param("map_topic", topic_, std::string("projected_map"));
    grid_ = GridCopy(node.param("write_unknown", false));
    const int method = node.param("combination_method", static_cast<int>(Combination::kMaximum));
    if (method != 0 && method != 1) {
      throw std::invalid_argument(name_ + "/combination_method is " + std::to_string(method) +
                                  "; known methods: 0 (overwrite), 1 (maximum)");
    }
    combination_ = static_cast<Combination>(method);
    settings_ = std::make_unique<Settings>(node);
    settings_->setCallback(
        [this](const costmap_2d::GenericPluginConfig& config, std::uint32_t) { enable(config.enabled); });
    activate();
  }

  void activate() override {
    reset();
    ros::NodeHandle node;
    grids_ = node.subscribe(topic_, 1, &SemanticLayer::receiveGrid, this);
    updates_ = node.subscribe(topic_ + "_updates", 100, &SemanticLayer::receiveUpdate, this);
  }

  void deactivate() override {
    grids_.shutdown();
    updates_.shutdown();
  }

  /// Keeps the grid: the mapper sends it whole only when it grows.
  void reset() override {
    const std::lock_guard lock(mutex_);
    everything_ = true;
  }

  void matchSize() override { reset(); }

  void updateBounds(double, double, double, double* min_x, double* min_y, double* max_x,
                    double* max_y) override {
    const std::lock_guard lock(mutex_);
    current_ = lookUp();
    if (!to_grid_) {
      enabled_ = wanted_;
      return;
    }
    const auto changes = grid_.takeChanges();
    const auto to_costmap = inverse(*to_grid_);
    const Box extent = to_costmap->boxAround(grid_.extent());
    Box box;
    const bool moved = costmapMoved();
    if (everything_ || moved || !changes) {
      box = extent;
      box.include(written_);
      written_ = extent;
    } else {
      box = to_costmap->boxAround(*changes);
      written_.include(extent);
    }
    everything_ = false;
    if (box.empty()) {
      enabled_ = wanted_;
      return;
    }
    *min_x = std::min(*min_x, box.min_x);
    *min_y = std::min(*min_y, box.min_y);
    *max_x = std::max(*max_x, box.max_x);
    *max_y = std::max(*max_y, box.max_y);
  }

  void updateCosts(costmap_2d::Costmap2D& master, int min_i, int min_j, int max_i, int max_j) override {
    const std::lock_guard lock(mutex_);
    // A layer that has been disabled takes part once more, and what it wrote is gone.
    enabled_ = wanted_;
    if (!enabled_ || !to_grid_) return;
    const Window window{master.getCharMap(),
                        master.getSizeInCellsX(),
                        master.getOriginX(),
                        master.getOriginY(),
                        master.getResolution(),
                        min_i,
                        min_j,
                        max_i,
                        max_j};
    if (grid_.write(window, *to_grid_, combination_)) return;
    current_ = false;
    warn("the grid is more than " + std::to_string(GridCopy::kMaxFiner) +
         " times finer than the costmap; make that finer");
  }

 private:
  using Settings = dynamic_reconfigure::Server<costmap_2d::GenericPluginConfig>;

  void receiveGrid(const nav_msgs::OccupancyGrid::ConstPtr& grid) {
    const std::lock_guard lock(mutex_);
    const std::string frame = grid_.frame();
    warn(grid_.replace(*grid));
    if (grid_.frame() != frame) to_grid_.reset();
  }

  void receiveUpdate(const map_msgs::OccupancyGridUpdate::ConstPtr& update) {
    const std::lock_guard lock(mutex_);
    warn(grid_.update(update));
  }

  void enable(bool wanted) {
    // Before the own mutex, as in updates of the costmap.
    const boost::unique_lock<costmap_2d::Costmap2D::mutex_t> costmap_lock(
        *layered_costmap_->getCostmap()->getMutex());
    const std::lock_guard lock(mutex_);
    if (wanted == wanted_ && wanted == enabled_) return;
    wanted_ = wanted;
    everything_ = true;
    if (wanted) enabled_ = true;
  }

  /// Renews to_grid_. Where tf has no transform, the last one stays. @return whether the layer is up to date.
  bool lookUp() {
    if (!grid_.known()) return false;
    const std::string& global_frame = layered_costmap_->getGlobalFrameID();
    Affine plane;
    if (global_frame != grid_.frame()) {
      try {
        plane = planeOf(tf_->lookupTransform(grid_.frame(), global_frame, ros::Time(0)).transform);
      } catch (const tf2::TransformException& error) {
        warn("tf does not know where the frame of the costmap is in that of the grid: " +
             std::string(error.what()));
        return false;
      }
      if (!inverse(plane)) {
        warn("the frame of the costmap, '" + global_frame + "', stands upright in that of the grid");
        return false;
      }
    }
    if (!to_grid_ || !(*to_grid_ == plane)) everything_ = true;
    to_grid_ = plane;
    return true;
  }

  /// Whether the costmap has other cells than at the last call, as a rolling one has after the robot moved.
  bool costmapMoved() {
    const costmap_2d::Costmap2D& master = *layered_costmap_->getCostmap();
    const std::array<double, 5> now{master.getOriginX(), master.getOriginY(), master.getResolution(),
                                    static_cast<double>(master.getSizeInCellsX()),
                                    static_cast<double>(master.getSizeInCellsY())};
    return std::exchange(costmap_cells_, now) != now;
  }

  /// Logs a sentence, once; sentences that differ only in numbers are one. "" is none.
  void warn(const std::string& sentence) {
    constexpr std::size_t kMaxSentences = 64;
    std::string key = sentence;
    const auto of_number = [](char c) {
      return std::isdigit(static_cast<unsigned char>(c)) || c == '.' || c == '-';
    };
    key.erase(std::remove_if(key.begin(), key.end(), of_number), key.end());
    if (key.empty() || said_.size() >= kMaxSentences || !said_.insert(key).second) return;
    ROS_WARN_STREAM(name_ << ": " << sentence);
  }

  std::string topic_;
  Combination combination_ = Combination::kMaximum;
  std::mutex mutex_;  ///< guards all below: messages come in other threads than updates of the costmap
  GridCopy grid_{false};
  std::optional<Affine> to_grid_;  ///< from the frame of the costmap
  Box written_;                    ///< where the layer may have written, in the frame of the costmap
  std::array<double, 5> costmap_cells_{};
  bool everything_ = true;  ///< the next update writes the whole grid
  bool wanted_ = false;     ///< `enabled` as set; enabled_ of the base class follows once the costs are gone
  std::set<std::string> said_;
  // Last, so that no call comes while the rest is destroyed.
  std::unique_ptr<Settings> settings_;
  ros::Subscriber grids_, updates_;
};

}  // namespace bki_mapping::costmap

PLUGINLIB_EXPORT_CLASS(bki_mapping::costmap::SemanticLayer, costmap_2d::Layer)
