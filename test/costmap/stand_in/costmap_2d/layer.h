/// @file Stands in for costmap_2d of ROS Noetic: the base of all layers.
#pragma once

#include <costmap_2d/layered_costmap.h>
#include <tf2_ros/buffer.h>

#include <string>
#include <utility>

namespace costmap_2d {

class Layer {
 public:
  virtual ~Layer() = default;

  void initialize(LayeredCostmap* parent, std::string name, tf2_ros::Buffer* tf) {
    layered_costmap_ = parent;
    name_ = std::move(name);
    tf_ = tf;
    onInitialize();
  }
  virtual void updateBounds(double /*robot_x*/, double /*robot_y*/, double /*robot_yaw*/, double* /*min_x*/,
                            double* /*min_y*/, double* /*max_x*/, double* /*max_y*/) {}
  virtual void updateCosts(Costmap2D& /*master*/, int /*min_i*/, int /*min_j*/, int /*max_i*/,
                           int /*max_j*/) {}
  virtual void deactivate() {}
  virtual void activate() {}
  virtual void reset() {}
  virtual void matchSize() {}
  virtual void onFootprintChanged() {}
  bool isCurrent() const { return current_; }
  std::string getName() const { return name_; }

 protected:
  virtual void onInitialize() {}

  LayeredCostmap* layered_costmap_ = nullptr;
  bool current_ = false;
  bool enabled_ = false;
  std::string name_;
  tf2_ros::Buffer* tf_ = nullptr;
};

inline void LayeredCostmap::resizeMap(unsigned int width, unsigned int height, double resolution, double x,
                                      double y) {
  costmap_.resize(width, height, resolution, x, y);
  for (const auto& layer : layers_) layer->matchSize();
}

inline int LayeredCostmap::updateMap() {
  const boost::unique_lock<Costmap2D::mutex_t> lock(*costmap_.getMutex());
  double min_x = 1e30, min_y = 1e30, max_x = -1e30, max_y = -1e30;
  for (const auto& layer : layers_) layer->updateBounds(0.0, 0.0, 0.0, &min_x, &min_y, &max_x, &max_y);
  const auto cellOf = [&](double at, double origin, unsigned int cells) {
    const double cell = std::floor((at - origin) / costmap_.getResolution());
    return static_cast<int>(std::clamp(cell, 0.0, static_cast<double>(cells) - 1.0));
  };
  const unsigned int width = costmap_.getSizeInCellsX(), height = costmap_.getSizeInCellsY();
  if (min_x > max_x || min_y > max_y) return 0;
  const int begin_i = cellOf(min_x, costmap_.getOriginX(), width),
            begin_j = cellOf(min_y, costmap_.getOriginY(), height);
  const int end_i = cellOf(max_x, costmap_.getOriginX(), width) + 1,
            end_j = cellOf(max_y, costmap_.getOriginY(), height) + 1;
  costmap_.clear(begin_i, begin_j, end_i, end_j);
  for (const auto& layer : layers_) layer->updateCosts(costmap_, begin_i, begin_j, end_i, end_j);
  return (end_i - begin_i) * (end_j - begin_j);
}

inline bool LayeredCostmap::isCurrent() const {
  for (const auto& layer : layers_) {
    if (!layer->isCurrent()) return false;
  }
  return true;
}

}  // namespace costmap_2d
