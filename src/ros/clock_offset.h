/// @file What a difference between two clocks looks like.
#pragma once

#include <ros/time.h>

#include <string>

namespace bki_mapping::ros_interface {

/// A duration for people, such as "350 ms", "37 s", "2 h" or "56 years". @param seconds >= 0.
std::string durationText(double seconds);

/// What a stamp looks like that is far from the time of tf, with the remedy: ", which looks like TAI instead
/// of UTC (PTP counts TAI); ...". For any other difference, the remedy only: "; synchronise ...".
/// @param stamp of a cloud. @param tf time of tf's transforms.
std::string clockAdvice(const ros::Time& stamp, const ros::Time& tf);

}  // namespace bki_mapping::ros_interface
