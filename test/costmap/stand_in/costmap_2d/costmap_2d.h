/// @file Stands in for costmap_2d of ROS Noetic: of its interface, what the layer calls.
#pragma once

#include <algorithm>
#include <boost/thread/recursive_mutex.hpp>
#include <cmath>
#include <vector>

namespace costmap_2d {

class Costmap2D {
 public:
  using mutex_t = boost::recursive_mutex;

  void resize(unsigned int width, unsigned int height, double resolution, double x, double y) {
    width_ = width;
    height_ = height;
    resolution_ = resolution;
    x_ = x;
    y_ = y;
    costs_.assign(std::size_t{width} * height, default_);
  }
  void setDefault(unsigned char cost) { default_ = cost; }
  /// Sets the cells of columns [begin_i, end_i) and rows [begin_j, end_j) to the default.
  void clear(int begin_i, int begin_j, int end_i, int end_j) {
    for (int j = begin_j; j < end_j; ++j) {
      for (int i = begin_i; i < end_i; ++i) costs_[cell(i, j)] = default_;
    }
  }
  unsigned char costAt(double x, double y) const {
    return costs_[cell(static_cast<int>(std::floor((x - x_) / resolution_)),
                       static_cast<int>(std::floor((y - y_) / resolution_)))];
  }

  unsigned char* getCharMap() const { return costs_.data(); }
  unsigned int getSizeInCellsX() const { return width_; }
  unsigned int getSizeInCellsY() const { return height_; }
  double getOriginX() const { return x_; }
  double getOriginY() const { return y_; }
  double getResolution() const { return resolution_; }
  mutex_t* getMutex() { return &mutex_; }

 private:
  std::size_t cell(int i, int j) const {
    return static_cast<std::size_t>(j) * width_ + static_cast<std::size_t>(i);
  }

  unsigned int width_ = 0, height_ = 0;
  double resolution_ = 1.0, x_ = 0.0, y_ = 0.0;
  unsigned char default_ = 255;
  mutable std::vector<unsigned char> costs_;
  mutex_t mutex_;
};

}  // namespace costmap_2d
