/// @file Stands in for costmap_2d of ROS Noetic: the costmap that layers write to, one after the other.
#pragma once

#include <costmap_2d/costmap_2d.h>

#include <boost/shared_ptr.hpp>
#include <string>
#include <utility>
#include <vector>

namespace costmap_2d {

class Layer;

class LayeredCostmap {
 public:
  explicit LayeredCostmap(std::string global_frame) : global_frame_(std::move(global_frame)) {}

  void addPlugin(const boost::shared_ptr<Layer>& layer) { layers_.push_back(layer); }
  void resizeMap(unsigned int width, unsigned int height, double resolution, double x, double y);
  /// Asks the layers where they have changed, clears the cells there, and lets the layers write them. @return
  /// the number of cells.
  int updateMap();
  /// Whether all layers are up to date.
  bool isCurrent() const;
  void removePlugins() { layers_.clear(); }

  Costmap2D* getCostmap() { return &costmap_; }
  std::string getGlobalFrameID() const { return global_frame_; }

 private:
  Costmap2D costmap_;
  std::string global_frame_;
  std::vector<boost::shared_ptr<Layer>> layers_;
};

}  // namespace costmap_2d
