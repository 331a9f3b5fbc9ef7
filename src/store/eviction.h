/// @file Which tiles leave memory for the map file: those outside of the window and, while memory runs short,
/// the farthest ones.
#pragma once

#include <algorithm>
#include <limits>
#include <optional>

namespace bki_mapping {

/// The window of a map, as large as its memory allows. Distances are those of tiles from its centre [m].
class Eviction {
 public:
  /// @param tile_edge of a tile [m].
  explicit Eviction(double tile_edge) : tile_edge_(tile_edge) {}

  /// Tiles up to this distance should be in memory [m].
  double reach() const { return std::min(0.5 * window_, allowed_); }
  /// Up to this distance, tiles are loaded [m].
  double loadingReach() const { return reach() + kStep * tile_edge_; }
  /// Whether a tile at a distance has to leave. It may stay a little outside of the window, so that a sensor
  /// that goes to and fro does not keep the disk busy.
  bool leaves(double distance) const { return distance > reach() + kMargin * tile_edge_; }
  /// Whether the window has moved far enough to look for tiles again. @param way of its centre [m].
  bool isDue(double way) const { return way > kStep * tile_edge_; }

  /// @param edge of the window [m]. @return whether it is another one.
  bool setWindow(double edge) {
    const bool differs = edge != window_;
    window_ = edge;
    return differs;
  }

  /// How much memory to take up [bytes], if it runs short. @param limit 0: there is none.
  static std::optional<double> bytesWhenShort(double bytes, double limit) {
    if (limit > 0.0 && bytes > kTooMuch * limit) return kEnough * limit;
    return std::nullopt;
  }
  /// How much memory to take up to make room for a scan that was refused [bytes].
  static double bytesToMakeRoom(double limit) { return limit > 0.0 ? kLittle * limit : kEverything; }
  /// Shrinks the window, so that the tile at a distance does not come back.
  void shrinkBelow(double distance) {
    allowed_ = std::max(0.0, std::min(allowed_, distance - (kMargin + kStep) * tile_edge_));
  }
  /// Lets a window that was shrunk grow by a step if there is memory again.
  void grow(double bytes, double limit) {
    if (!(allowed_ < kEverything) || (limit > 0.0 && bytes >= kLittle * limit)) return;
    allowed_ += kMargin * tile_edge_;
    if (allowed_ >= 0.5 * window_) allowed_ = kEverything;
  }
  /// Forgets that memory ran short.
  void reset() { allowed_ = kEverything; }

 private:
  static constexpr double kEverything = std::numeric_limits<double>::infinity();
  /// Fractions of the memory limit: above the first, the window shrinks until the map takes the second; below
  /// the third, it grows again.
  static constexpr double kTooMuch = 0.85, kEnough = 0.7, kLittle = 0.5;
  /// Fractions of a tile's edge: how far the window moves before tiles are loaded and evicted, and how far
  /// outside of it a tile may stay.
  static constexpr double kStep = 0.25, kMargin = 0.5;

  double tile_edge_;
  double window_ = kEverything;   ///< edge [m]
  double allowed_ = kEverything;  ///< half the edge of the window that memory allows [m]
};

}  // namespace bki_mapping
