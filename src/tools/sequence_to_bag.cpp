// Writes a sequence in SemanticKITTI's layout as a bag of clouds and tf.
#include <rosbag/bag.h>

#include <cstdlib>
#include <iostream>
#include <memory>

#include "core/atomic_file.h"
#include "tools/sequence_messages.h"
#include "tools/sequence_options.h"

namespace {

using namespace bki_mapping;
namespace po = tools::po;

po::options_description options() {
  po::options_description options("Options");
  options.add_options()("output", tools::textOption("FILE.bag")->required(), "output bag")(
      "cloud-topic", tools::textOption("TOPIC")->default_value("/velodyne_points"), "topic of the clouds")(
      "frame", tools::textOption("FRAME")->default_value("velodyne"), "frame of the sensor")(
      "map-frame", tools::textOption("FRAME")->default_value("map"), "frame of the map")(
      "compression", tools::textOption("KIND")->default_value("none"), "compression: none, lz4 or bz2");
  options.add(tools::sequenceOptions());
  return options;
}

rosbag::CompressionType compression(const std::string& name) {
  if (name == "none") return rosbag::compression::Uncompressed;
  if (name == "lz4") return rosbag::compression::LZ4;
  if (name == "bz2") return rosbag::compression::BZ2;
  throw std::invalid_argument("--compression '" + name + "' is unknown; known kinds: none, lz4, bz2");
}

int writeBag(const po::variables_map& given) {
  const Sequence sequence = tools::openSequence(given);
  const auto [first, last] = tools::frameRange(given, sequence);
  tools::warnOfPoses(given, first, last);
  const tools::FrameNames names{given["map-frame"].as<std::string>(), given["frame"].as<std::string>()};
  const std::string output = given["output"].as<std::string>();
  AtomicFile file(output);
  auto bag = std::make_unique<rosbag::Bag>();
  try {
    bag->open(file.temporaryPath(), rosbag::bagmode::Write);
    bag->setCompression(compression(given["compression"].as<std::string>()));
    for (std::size_t i = first; i < last; ++i) {
      const SequenceFrame frame = sequence.read(i);
      const ros::Time stamp = ros::Time().fromNSec(frame.stamp);
      bag->write("/tf", stamp, tools::tfMessage(frame, names));
      bag->write(given["cloud-topic"].as<std::string>(), stamp, tools::cloudMessage(frame, names));
      tools::showProgress(i + 1 - first, last - first, "scans");
    }
    bag->close();
  } catch (const rosbag::BagException& fault) {
    static_cast<void>(
        bag.release());  // leaked on purpose: its destructor would write, throw, and terminate the process
    throw writeFailure(output, fault.what());
  }
  file.commit();
  std::cout << last - first << " scans in " << output << "\n";
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const int status = tools::run(argc, argv, "sequence_to_bag",
                                "Writes a sequence in SemanticKITTI's layout as a bag of clouds and tf.",
                                options(), writeBag);
  // At a usual exit class_loader 2.8 would complain of the plugin that a leaked bag still holds.
  if (status != 0) std::quick_exit(status);
  return status;
}
