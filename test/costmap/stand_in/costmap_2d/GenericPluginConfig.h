/// @file Stands in for costmap_2d of ROS Noetic: the dynamic parameter `enabled` of a layer, with what
/// dynamic_reconfigure::Server calls.
#pragma once

#include <dynamic_reconfigure/Config.h>
#include <dynamic_reconfigure/ConfigDescription.h>
#include <dynamic_reconfigure/config_tools.h>
#include <ros/node_handle.h>

#include <cstdint>
#include <vector>

namespace costmap_2d {

struct GenericPluginConfig {
  bool enabled = true;

  void __fromMessage__(dynamic_reconfigure::Config& message) {
    dynamic_reconfigure::ConfigTools::getParameter(message, "enabled", enabled);
  }
  void __toMessage__(dynamic_reconfigure::Config& message) const {
    dynamic_reconfigure::ConfigTools::clear(message);
    dynamic_reconfigure::ConfigTools::appendParameter(message, "enabled", enabled);
  }
  void __fromServer__(const ros::NodeHandle& node) { node.getParam("enabled", enabled); }
  void __toServer__(const ros::NodeHandle& node) const { node.setParam("enabled", enabled); }
  void __clamp__() {}
  std::uint32_t __level__(const GenericPluginConfig& other) const { return enabled != other.enabled ? 1 : 0; }

  static GenericPluginConfig __getDefault__() { return {}; }
  static GenericPluginConfig __getMin__() { return {false}; }
  static GenericPluginConfig __getMax__() { return {true}; }
  static dynamic_reconfigure::ConfigDescription __getDescriptionMessage__() { return {}; }
};

}  // namespace costmap_2d
