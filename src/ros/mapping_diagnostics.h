/// @file The mapper's health on /diagnostics.
#pragma once

#include <diagnostic_updater/diagnostic_updater.h>

#include <chrono>
#include <string>

#include "bki_mapping/mapping/mapper_config.h"
#include "ros/point_account.h"
#include "ros/scan_ledger.h"

namespace bki_mapping::ros_interface {

/// Assesses the time between two reports.
/// - ERROR: clouds were received, and none was integrated.
/// - WARN: clouds were dropped, mapping is paused or slower than clouds arrive, no cloud was received, the
///   map stays empty although points are used, or particles or missing returns tell of bad weather.
/// - The result of judgePoints for the points of integrated clouds.
Health judge(const MappingStatus& before, const MappingStatus& now, const MapperConfig& config,
             const Health& points = {});

/// Publishes a report every `period` seconds.
class MappingDiagnostics {
 public:
  /// @param name of the diagnostic status, as rqt_robot_monitor shows it. @param period [s, wall time].
  MappingDiagnostics(const ros::NodeHandle& node, const ros::NodeHandle& private_node, double period);

  /// Reports if a report is due. Only then calls status() and points().
  /// @param status returns the MappingStatus. @param points returns the Health of the points since the last
  /// report.
  template <typename Status, typename Points>
  void update(Status&& status, Points&& points, const MapperConfig& config) {
    const auto now = std::chrono::steady_clock::now();
    if (std::chrono::duration<double>(now - last_).count() < period_) return;
    last_ = now;
    report(status(), config, points());
  }

 private:
  void report(const MappingStatus& status, const MapperConfig& config, const Health& points);
  void fill(diagnostic_updater::DiagnosticStatusWrapper& out) const;

  diagnostic_updater::Updater updater_;
  double period_;
  std::chrono::steady_clock::time_point last_;
  MappingStatus before_, now_;
  Health health_;
};

}  // namespace bki_mapping::ros_interface
