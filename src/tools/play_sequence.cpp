// Publishes a sequence in SemanticKITTI's layout as clouds, tf and /clock.
#include <bki_mapping/MappingStatus.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <rosgraph_msgs/Clock.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <set>
#include <stdexcept>

#include "tools/sequence_messages.h"
#include "tools/sequence_options.h"

namespace {

using namespace bki_mapping;
namespace po = tools::po;

/// Timeouts for the first subscriber and for an acknowledgement [s].
constexpr double kListenerWait = 60.0, kAcknowledgeWait = 60.0;
constexpr double kClockStep = 0.01;  ///< interval of /clock [s of wall time]

po::options_description options() {
  po::options_description options("Options");
  options.add_options()("rate", tools::realOption("--rate", 0.0)->value_name("FACTOR")->default_value(1.0),
                        "factor of real time; 0: wait until `mapping/status` acknowledges each scan")(
      "frame", tools::textOption("FRAME")->default_value("velodyne"), "frame of the sensor")(
      "map-frame", tools::textOption("FRAME")->default_value("map"), "frame of the map")(
      "check", "check the sequence, print its absolute path, and exit; for launch files");
  options.add(tools::sequenceOptions());
  return options;
}

/// Publishes frames, and the time between them.
class Player {
 public:
  explicit Player(const tools::FrameNames& names) : names_(names) {
    cloud_ = node_.advertise<sensor_msgs::PointCloud2>("cloud_in", 10, namesOf(cloud_listeners_));
    tf_ = node_.advertise<tf2_msgs::TFMessage>("/tf", 100, namesOf(tf_listeners_), {}, {},
                                               true);  // latched: a late subscriber gets the last pose
    clock_ = node_.advertise<rosgraph_msgs::Clock>("/clock", 10);
    status_ = node_.subscribe("mapping/status", 100, &Player::onStatus, this);
  }

  /// Waits until the clouds and the poses have a subscriber. @param mapper wait for the mapper, not just for
  /// rviz: a mapper that misses the first cloud would never acknowledge it, and one that misses its pose
  /// would drop it.
  void waitForListener(bool mapper) {
    const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(kListenerWait);
    const auto missing = [&] {
      return cloud_.getNumSubscribers() == 0 || tf_.getNumSubscribers() == 0 ||
             (mapper && (cloud_listeners_.count(mapper_) == 0 || tf_listeners_.count(mapper_) == 0));
    };
    while (ros::ok() && missing()) {
      if (ros::WallTime::now() > end) {
        throw std::runtime_error((mapper ? "no mapper with " + status_.getTopic() : std::string("nobody")) +
                                 " subscribed to " + cloud_.getTopic() +
                                 " and /tf within 60 s; start the mapper");
      }
      ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(kClockStep));
    }
  }

  void publish(const SequenceFrame& frame) {
    acknowledged_ = 0;  // the mapper may have acknowledged this stamp in an earlier run
    publishClock(frame.stamp);
    tf_.publish(tools::tfMessage(frame, names_));
    cloud_.publish(tools::cloudMessage(frame, names_));
  }

  void publishClock(std::uint64_t nanoseconds) {
    rosgraph_msgs::Clock clock;
    clock.clock.fromNSec(nanoseconds);
    clock_.publish(clock);
  }

  void waitForAcknowledgement(const SequenceFrame& frame) {
    const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(kAcknowledgeWait);
    while (ros::ok() && acknowledged_ != frame.stamp) {
      if (ros::WallTime::now() > end) {
        throw std::runtime_error(status_.getTopic() +
                                 " did not acknowledge a scan within 60 s; check the mapper");
      }
      ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(kClockStep));
    }
  }

 private:
  /// Collects the names of those that subscribe.
  static ros::SubscriberStatusCallback namesOf(std::set<std::string>& names) {
    return [&names](const ros::SingleSubscriberPublisher& link) { names.insert(link.getSubscriberName()); };
  }

  void onStatus(const ros::MessageEvent<const MappingStatus>& event) {
    mapper_ = event.getPublisherName();
    acknowledged_ = event.getConstMessage()->header.stamp.toNSec();
  }

  tools::FrameNames names_;
  ros::NodeHandle node_;
  ros::Publisher cloud_, tf_, clock_;
  ros::Subscriber status_;
  std::set<std::string> cloud_listeners_, tf_listeners_;  ///< nodes subscribed to the clouds, to the poses
  std::string mapper_;  ///< node that publishes the status; empty: unknown yet
  std::uint64_t acknowledged_ = 0;
};

/// The absolute path. Expands ~, which shells leave in sequence:=~/DIR.
std::filesystem::path absolutePath(const std::string& path) {
  const char* home = std::getenv("HOME");
  if (path.rfind("~/", 0) == 0 && home != nullptr) return home + path.substr(1);
  return std::filesystem::absolute(path).lexically_normal();
}

/// Takes --sequence from the parameter ~sequence: launch files resolve the folder relative to where roslaunch
/// was called, because the node runs in another folder.
void takeFolderOfParameter(po::variables_map& given) {
  std::string folder;
  if (!given.count("sequence") && ros::param::get("~sequence", folder)) {
    given.insert({"sequence", po::variable_value(folder, false)});
  }
}

/// Prints the path of a sequence that can be played. @throws as Sequence.
int check(const po::variables_map& given) {
  const SequenceOptions options = tools::sequenceOptionsOf(given);
  const std::string folder = absolutePath(given["sequence"].as<std::string>()).string();
  Sequence(folder, options).read(0);
  std::cout << folder;  // no newline: roslaunch would make it part of the path
  return 0;
}

int play(const po::variables_map& given) {
  const Sequence sequence = tools::openSequence(given);
  const auto [first, last] = tools::frameRange(given, sequence);
  tools::warnOfPoses(given, first, last);
  const double rate = given["rate"].as<double>();

  Player player({given["map-frame"].as<std::string>(), given["frame"].as<std::string>()});
  player.waitForListener(rate == 0.0);
  const ros::WallTime start = ros::WallTime::now();
  std::uint64_t first_stamp = 0;
  std::size_t played = 0;
  for (std::size_t i = first; i < last && ros::ok(); ++i) {
    const SequenceFrame frame = sequence.read(i);
    if (i == first) first_stamp = frame.stamp;
    const auto due = [&] { return static_cast<double>(frame.stamp - first_stamp) * 1e-9; };
    while (rate > 0.0 && ros::ok()) {
      const double now = (ros::WallTime::now() - start).toSec() * rate;
      if (now >= due()) break;
      player.publishClock(first_stamp + static_cast<std::uint64_t>(now * 1e9));
      ros::WallDuration(std::min(kClockStep, (due() - now) / rate)).sleep();
    }
    if (!ros::ok()) break;
    player.publish(frame);
    ++played;
    if (rate == 0.0) player.waitForAcknowledgement(frame);
    tools::showProgress(i + 1 - first, last - first, "scans");
  }
  std::cout << "played " << played;
  if (played < last - first) std::cout << " of " << last - first;
  std::cout << " scans\n";
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return tools::run("play_sequence", [&] {
    std::vector<std::string> arguments;
    ros::removeROSArgs(argc, argv, arguments);
    std::vector<char*> pointers;
    for (std::string& argument : arguments) pointers.push_back(argument.data());
    const auto given = tools::parse(
        static_cast<int>(pointers.size()), pointers.data(),
        "Publishes a sequence in SemanticKITTI's layout as cloud_in, /tf and /clock.", options());
    if (!given) return 0;
    if (given->count("check")) return check(*given);
    ros::init(argc, argv, "play_sequence");
    // SIGTERM ends it as SIGINT does: ros::ok() becomes false, and destructors run.
    std::signal(SIGTERM, [](int) { ros::requestShutdown(); });
    takeFolderOfParameter(*given);
    return play(*given);
  });
}
