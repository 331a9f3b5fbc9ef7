// Times publishing while the map of a simulated drive grows: every map topic, with one subscriber each.
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <topic_tools/shape_shifter.h>

#include <algorithm>
#include <fstream>
#include <iostream>

#include "bki_mapping/io/class_table_yaml.h"
#include "bki_mapping/mapping/semantic_mapper.h"
#include "core/stopwatch.h"
#include "ros/map_publisher.h"
#include "simulation/lidar.h"
#include "tools/options.h"

namespace {

using namespace bki_mapping;
using namespace bki_mapping::ros_interface;
namespace po = tools::po;

po::options_description options() {
  po::options_description options("Options");
  options.add_options()(
      "scans", tools::countOption("--scans", 50, 1000000)->value_name("N")->default_value(400),
      "length of the drive")("every", tools::countOption("--every", 1)->value_name("N")->default_value(5),
                             "scans between two publications")(
      "csv", po::value<std::string>()->value_name("FILE"), "table of all times")(
      "view-range", tools::realOption("--view-range", 0.0)->value_name("M")->default_value(0.0),
      "parameter view_range [m]");
  return options;
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

int measure(const po::variables_map& given) {
  const auto scans = tools::count(given, "scans");
  const auto every = tools::count(given, "every");
  ServerConfig config;
  config.view_range = given["view-range"].as<double>();
  SemanticMapper mapper(MapperConfig(), std::make_shared<const ClassTable>(loadClassTable(config.classes)));
  std::vector<geometry_msgs::PoseStamped> trajectory;
  Eigen::Vector3d sensor = Eigen::Vector3d::Zero();
  ros::NodeHandle node("~");
  ros::CallbackQueue connections, unread;
  node.setCallbackQueue(&connections);
  const auto snapshot = [&] {
    return MapSnapshot{{}, mapper.map(), mapper.classes(), trajectory, config, sensor};
  };
  const auto publishers = makePublishers({node, config, snapshot});

  ros::NodeHandle listener("~");
  listener.setCallbackQueue(&unread);
  std::vector<ros::Subscriber> subscribers;
  for (const auto& publisher : publishers) {
    const boost::function<void(const topic_tools::ShapeShifter::ConstPtr&)> ignore =
        [](const topic_tools::ShapeShifter::ConstPtr&) {};
    subscribers.push_back(listener.subscribe(publisher->topic(), 1, ignore));
  }
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
  std::vector<std::size_t> blocks;
  for (std::size_t i = 0; i < scans && ros::ok(); ++i) {
    const Scan scan = drive.frame(i).scan();
    mapper.integrate(scan);
    sensor = scan.origin;
    trajectory.emplace_back();
    for (const auto& publisher : publishers) publisher->changed.add(mapper.touchedBlocks());
    if (i % every != 0) continue;
    blocks.push_back(mapper.map().size());
    for (std::size_t p = 0; p < publishers.size(); ++p) {
      Stopwatch watch;
      publishers[p]->publish(snapshot());
      times[p].push_back(watch.lap());
      csv << publishers[p]->topic() << ',' << i << ',' << blocks.back() << ',' << times[p].back() << '\n';
    }
    unread.clear();
    tools::showProgress(i + 1, scans, "scans");
  }
  csv.close();
  if (given.count("csv") > 0 && !csv) throw std::runtime_error("the CSV file cannot be written");
  // The first fifth against the last shows which times grow with the map.
  const std::size_t n = times[0].size(), fifth = std::max<std::size_t>(n / 5, 1);
  std::printf("map: %zu blocks after %zu scans, %zu in the end\n", blocks[fifth / 2], (fifth / 2) * every,
              blocks.back());
  std::printf("%-60s %10s %10s\n", "topic: median time to build and send [ms]", "first 5th", "last 5th");
  for (std::size_t p = 0; p < publishers.size(); ++p) {
    const auto begin = times[p].begin();
    const std::vector<double> first(begin, begin + static_cast<std::ptrdiff_t>(fifth));
    const std::vector<double> last(times[p].end() - static_cast<std::ptrdiff_t>(fifth), times[p].end());
    std::printf("%-60s %10.2f %10.2f\n", publishers[p]->topic().c_str(), median(first), median(last));
  }
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
    return measure(*given);
  });
}
