// Times publishing while the map of a simulated drive grows: every map topic, with one subscriber each.
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <topic_tools/shape_shifter.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <fstream>
#include <iostream>
#include <thread>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/settings/yaml.h"
#include "core/quantile.h"
#include "core/stopwatch.h"
#include "ros/publisher_set.h"
#include "ros/queued_call.h"
#include "simulation/lidar.h"
#include "tools/options.h"

namespace {

using namespace bki_mapping;
using namespace bki_mapping::ros_interface;
using Snapshot = bki_mapping::ros_interface::ServerSnapshot;  // there is another in the core
namespace po = tools::po;

po::options_description options() {
  po::options_description options("Options");
  options.add_options()(
      "scans", tools::countOption("--scans", 50, 1000000)->value_name("N")->default_value(400),
      "length of the drive")("every", tools::countOption("--every", 1)->value_name("N")->default_value(5),
                             "scans between two publications")(
      "csv", po::value<std::string>()->value_name("FILE"), "table of all times")(
      "view-range", tools::realOption("--view-range", 0.0)->value_name("M")->default_value(0.0),
      "parameter view_range [m]")("waits", tools::realOption("--waits", 0.1)->value_name("HZ"),
                                  "instead, send scans at this rate, without and with subscribers, and "
                                  "measure how long each takes to be in the map; keeps all scans in memory");
  return options;
}

/// Receives all topics of this node and drops what it receives.
class Listener {
 public:
  Listener() { node_.setCallbackQueue(&unread_); }
  void subscribe(const std::string& topic) {
    const boost::function<void(const topic_tools::ShapeShifter::ConstPtr&)> ignore =
        [](const topic_tools::ShapeShifter::ConstPtr&) {};
    subscribers_.push_back(node_.subscribe(topic, 1, ignore));
  }
  /// Subscribes to the map topics, and waits until their publishers know.
  void subscribeToAll() {
    ros::master::V_TopicInfo topics;
    ros::master::getTopics(topics);
    for (const auto& topic : topics) {
      if (topic.name.rfind(node_.getNamespace() + '/', 0) == 0) subscribe(topic.name);
    }
    const auto connected = [](const ros::Subscriber& s) { return s.getNumPublishers() > 0; };
    while (ros::ok() && !std::all_of(subscribers_.begin(), subscribers_.end(), connected)) {
      ros::WallDuration(0.05).sleep();
    }
  }
  void dropMessages() { unread_.clear(); }

 private:
  ros::NodeHandle node_{"~"};
  ros::CallbackQueue unread_;
  std::vector<ros::Subscriber> subscribers_;
};

int measureTopics(const po::variables_map& given) {
  const auto scans = tools::count(given, "scans");
  const auto every = tools::count(given, "every");
  ServerConfig config;
  config.view_range = given["view-range"].as<double>();
  SemanticMapper mapper(MapperConfig(), std::make_shared<const ClassTable>(loadClassTable(config.classes)));
  std::vector<SensorPose> trajectory;
  Eigen::Vector3d sensor = Eigen::Vector3d::Zero();
  ros::NodeHandle node("~");
  ros::CallbackQueue connections;
  node.setCallbackQueue(&connections);
  const auto snapshot = [&] {
    return std::make_shared<const Snapshot>(
        Snapshot{mapper.snapshot(), {}, mapper.classes(), trajectory, config, sensor, 0});
  };
  const auto publishers = makePublishers({node, config, snapshot});
  Listener listener;
  for (const auto& publisher : publishers) listener.subscribe(publisher->topic());
  const auto all = [&] {
    return std::all_of(publishers.begin(), publishers.end(), [](const auto& p) { return p->wanted(); });
  };
  while (ros::ok() && !all()) ros::WallDuration(0.05).sleep();
  connections.callAvailable(ros::WallDuration(0.5));

  const simulation::Drive drive({static_cast<int>(scans), 8.0, 1, {}});
  std::ofstream csv;
  if (given.count("csv") > 0) csv.open(given["csv"].as<std::string>());
  csv << "topic,scan,blocks,ms\n";
  std::vector<std::vector<double>> times(publishers.size());
  std::vector<double> snapshots;
  std::vector<std::size_t> blocks;
  for (std::size_t i = 0; i < scans && ros::ok(); ++i) {
    const Scan scan = drive.frame(i).scan();
    mapper.integrate(scan);
    sensor = scan.origin;
    trajectory.emplace_back();
    for (const auto& publisher : publishers) publisher->changed.add(mapper.touchedBlocks());
    if (i % every != 0) continue;
    blocks.push_back(mapper.map().size());
    Stopwatch watch;
    const auto now = snapshot();
    snapshots.push_back(watch.lap());
    for (std::size_t p = 0; p < publishers.size(); ++p) {
      watch.lap();
      publishers[p]->publish(*now);
      times[p].push_back(watch.lap());
      csv << publishers[p]->topic() << ',' << i << ',' << blocks.back() << ',' << times[p].back() << '\n';
    }
    listener.dropMessages();
    tools::showProgress(i + 1, scans, "scans");
  }
  csv.close();
  if (given.count("csv") > 0 && !csv) throw std::runtime_error("the CSV file cannot be written");
  // The first fifth against the last shows which times grow with the map.
  const std::size_t n = snapshots.size(), fifth = std::max<std::size_t>(n / 5, 1);
  const auto print = [&](const std::string& name, const std::vector<double>& of_all) {
    const auto part = static_cast<std::ptrdiff_t>(fifth);
    std::printf("%-60s %10.2f %10.2f\n", name.c_str(), quantile({of_all.begin(), of_all.begin() + part}, 0.5),
                quantile({of_all.end() - part, of_all.end()}, 0.5));
  };
  std::printf("map: %zu blocks after %zu scans, %zu in the end\n", blocks[fifth / 2], (fifth / 2) * every,
              blocks.back());
  std::printf("%-60s %10s %10s\n", "topic: median time to build and send [ms]", "first 5th", "last 5th");
  print("snapshot", snapshots);
  for (std::size_t p = 0; p < publishers.size(); ++p) print(publishers[p]->topic(), times[p]);
  return 0;
}

/// Maps scans that arrive at a fixed rate. @return for each, the time from its arrival until it is in the map
/// [ms].
std::vector<double> waits(const std::vector<Scan>& scans, double rate, bool listens) {
  const ServerConfig config;
  SemanticMapper mapper(MapperConfig(), std::make_shared<const ClassTable>(loadClassTable(config.classes)));
  std::vector<SensorPose> trajectory;
  Eigen::Vector3d sensor = Eigen::Vector3d::Zero();
  ros::CallbackQueue queue;
  PublisherSet* publishers = nullptr;
  const auto snapshot = [&] {
    publishers->closeChanges();
    return Snapshot{mapper.snapshot(), {}, mapper.classes(), trajectory, config, sensor, 0};
  };
  std::vector<double> waits;
  std::atomic<bool> mapped{false}, done{false};
  PublisherSet publishing(ros::NodeHandle("~"), config, [&] {
    return QueuedCall<std::shared_ptr<const Snapshot>>::ask(
        queue, [&] { return std::make_shared<const Snapshot>(snapshot()); });
  });
  publishers = &publishing;
  publishing.start();
  Listener listener;
  std::thread mapping([&] {
    const auto start = std::chrono::steady_clock::now() + std::chrono::seconds(2);
    for (const Scan& scan : scans) {
      const std::chrono::duration<double> after(static_cast<double>(waits.size()) / rate);
      const auto comes = start + std::chrono::duration_cast<std::chrono::nanoseconds>(after);
      const auto since = [&] {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - comes).count();
      };
      while (since() < 0.0) queue.callAvailable(ros::WallDuration(-since()));
      queue.callAvailable();
      mapper.integrate(scan);
      waits.push_back(1e3 * since());
      sensor = scan.origin;
      trajectory.emplace_back();
      publishing.changed(mapper.touchedBlocks());
      tools::showProgress(waits.size(), scans.size(), "scans");
    }
    mapped = true;
    while (!done) queue.callAvailable(ros::WallDuration(0.01));  // the publishers may still ask
  });
  if (listens) listener.subscribeToAll();
  while (!mapped) {
    ros::WallDuration(0.05).sleep();
    listener.dropMessages();
  }
  publishing.stop();
  done = true;
  mapping.join();
  std::printf("%s: %zu blocks; wait of a scan [ms]: median %.1f, 90 %% %.1f, 99 %% %.1f, worst %.1f\n",
              listens ? "all topics subscribed" : "no subscriber       ", mapper.map().size(),
              quantile(waits, 0.5), quantile(waits, 0.9), quantile(waits, 0.99), quantile(waits, 1.0));
  return waits;
}

int measureWaits(const po::variables_map& given) {
  const auto count = tools::count(given, "scans");
  const simulation::Drive drive({static_cast<int>(count), 8.0, 1, {}});
  std::vector<Scan> scans;
  for (std::size_t i = 0; i < count; ++i) scans.push_back(drive.frame(i).scan());
  const double rate = given["waits"].as<double>();
  const double without = quantile(waits(scans, rate, false), 0.99);
  std::printf("99 %%: ratio %.2f\n", quantile(waits(scans, rate, true), 0.99) / without);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "benchmark_publishing");
  return tools::run("benchmark_publishing", [&] {
    const auto given =
        tools::parse(argc, argv,
                     "Times the publishing of every map topic while the map of a simulated drive "
                     "grows. Needs a roscore.",
                     options());
    if (!given) return 0;
    if (!ros::master::check()) throw std::runtime_error("no ROS master is running; start roscore");
    return given->count("waits") > 0 ? measureWaits(*given) : measureTopics(*given);
  });
}
