// The parameters of the server; the documents name every topic, service and field.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>

#include "bki_mapping/mapping/mapper_config.h"
#include "other_value.h"
#include "refusal_of.h"
#include "ros/live_settings.h"
#include "ros/point_account.h"
#include "ros/scan_ledger.h"
#include "ros/server_config.h"

namespace bki_mapping::ros_interface {
namespace {

namespace fs = std::filesystem;
const fs::path kRoot = BKI_MAPPING_SOURCE_DIR;

std::string textOf(const fs::path& file) {
  std::ifstream in(file);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

TEST(ServerConfig, FramesLoseOneLeadingSlash) {
  ServerConfig server;
  MapperConfig mapper;
  setParameters({{"frame_id", "/odom"},
                 {"sensor_frame_id", "/lidar"},
                 {"inputs/rear/sensor_frame_id", "/rear"},
                 {"inputs/front/topic", "/front"}},
                server, mapper);
  EXPECT_EQ(server.frame_id, "odom");
  const std::vector<InputConfig> inputs = allInputs(server, mapper);
  ASSERT_EQ(inputs.size(), 2u);
  EXPECT_EQ(inputs[0].sensor_frame_id, "lidar");
  EXPECT_EQ(inputs[1].sensor_frame_id, "rear");
  for (const char* name : {"frame_id", "sensor_frame_id", "inputs/rear/sensor_frame_id"}) {
    EXPECT_THROW(setParameters({{name, "//odom"}}, server, mapper), std::invalid_argument) << name;
  }
  for (const char* nothing : {"", "/"}) {
    EXPECT_THROW(setParameters({{"frame_id", nothing}}, server, mapper), std::invalid_argument);
    EXPECT_NO_THROW(setParameters({{"sensor_frame_id", nothing}}, server, mapper));
  }
  EXPECT_EQ(server.frame_id, "odom") << "as it was";
}

TEST(ServerConfig, SetsBothKindsAndRefusesBothKinds) {
  ServerConfig server;
  MapperConfig mapper;
  setParameters({{"frame_id", "odom"}, {"prior", "0.5"}, {"color_mode", "height"}, {"latch", "true"}}, server,
                mapper);
  EXPECT_EQ(server.frame_id, "odom");
  EXPECT_EQ(server.color_mode, ColorMode::kHeight);
  EXPECT_TRUE(server.latch);
  EXPECT_EQ(mapper.prior, 0.5);
  const std::string text = refusalOf([&] {
    setParameters({{"frame", "odom"}, {"queue_size", "0"}, {"prior", "x"}}, server, mapper);
  });
  for (const char* words : {"'frame' is unknown", "queue_size is '0'", "prior is 'x'"}) {
    EXPECT_NE(text.find(words), std::string::npos) << text;
  }
  EXPECT_EQ(mapper.prior, 0.5);
  EXPECT_THROW(setParameters({{"occupancy_min_z", "2"}, {"occupancy_max_z", "1"}}, server, mapper),
               std::invalid_argument);
}

TEST(ServerConfig, EachParameterSetsItsOwnMemberAndNoOther) {
  expectOwnMembers(serverParameters());
  expectOwnMembers(ownInputParameters());
}

TEST(ServerConfig, ParametersHaveNamesOfTheirOwnAndDescriptionsInSentences) {
  expectNamesAndDescriptions(serverParameters());
  expectNamesAndDescriptions(ownInputParameters());
}

TEST(ServerConfig, InputsTakeOverWhatTheyDoNotSet) {
  ServerConfig server;
  MapperConfig mapper;
  setParameters({{"label_field", "class"}, {"sensor_model/max_range", "50"}}, server, mapper);
  ASSERT_EQ(allInputs(server, mapper).size(), 1u);
  EXPECT_EQ(allInputs(server, mapper)[0].topic, "cloud_in");
  EXPECT_EQ(allInputs(server, mapper)[0].label_field, "class");
  setParameters({{"inputs/front/topic", "/front/points"},
                 {"inputs/front/max_range", "20"},
                 {"inputs/rear/label_encoding", "bgr"},
                 {"clear_no_returns", "true"}},
                server, mapper);
  const std::vector<InputConfig> inputs = allInputs(server, mapper);
  ASSERT_EQ(inputs.size(), 2u);
  EXPECT_EQ(inputs[0].topic, "/front/points");
  EXPECT_EQ(inputs[0].sensor_model.max_range, 20.0);
  EXPECT_EQ(inputs[0].label_field, "class");
  EXPECT_EQ(inputs[1].topic, "rear");
  EXPECT_EQ(inputs[1].sensor_model.max_range, 50.0);
  EXPECT_EQ(inputs[1].label_encoding, LabelEncoding::kBgr);
  EXPECT_TRUE(inputs[1].clear_no_returns);
  const std::string text = refusalOf([&] {
    setParameters({{"inputs/front/label_encodin", "rgb"}, {"inputs/rear/max_range", "-2"}}, server, mapper);
  });
  EXPECT_NE(text.find("did you mean 'inputs/front/label_encoding'"), std::string::npos) << text;
  EXPECT_NE(text.find("-2"), std::string::npos) << text;
  ServerConfig unlimited;
  EXPECT_THROW(
      setParameters({{"clear_no_returns", "true"}, {"sensor_model/max_range", "-1"}}, unlimited, mapper),
      std::invalid_argument);
}

TEST(LiveSettings, ShowAndTakeEveryParameterThatChangesWhileMapping) {
  ServerConfig server, taken_server;
  MapperConfig mapper, taken_mapper;
  const auto change = [](const auto& parameters, auto& config) {
    for (const auto& p : parameters) {
      if (p.changesWhileMapping()) p.set(config, otherValue(p, config));
    }
  };
  change(serverParameters(), server);
  change(mapperParameters(), mapper);
  LiveSettings::take(LiveSettings::show(server, mapper), taken_server, taken_mapper);
  for (const auto& p : serverParameters()) EXPECT_TRUE(p.equal(taken_server, server)) << p.name;
  for (const auto& p : mapperParameters()) EXPECT_TRUE(p.equal(taken_mapper, mapper)) << p.name;
}

TEST(LiveSettings, DefaultsAreTheParameters) {
  MappingConfig defaults = MappingConfig::__getDefault__();
  ServerConfig server;
  MapperConfig mapper;
  server.color_mode = ColorMode::kHeight;
  server.window = 7.0;
  mapper.free_space.mode = "even";
  mapper.rules.stands_after = 3.0;
  LiveSettings::take(defaults, server, mapper);
  for (const auto& p : serverParameters()) EXPECT_TRUE(p.equal(server, ServerConfig())) << p.name;
  for (const auto& p : mapperParameters()) EXPECT_TRUE(p.equal(mapper, MapperConfig())) << p.name;
}

TEST(LiveSettings, RefuseEachThatIsShownOnly) {
  for (const std::string& name : shownAtStart()) {
    ServerConfig server;
    MapperConfig mapper;
    ServerConfig other_server;
    MapperConfig other_mapper;
    const auto change = [&](const auto& parameters, auto& config) {
      for (const auto& p : parameters) {
        if (p.name == name) p.set(config, otherValue(p, config));
      }
    };
    change(serverParameters(), other_server);
    change(mapperParameters(), other_mapper);
    EXPECT_EQ(refusalOf([&] {
                LiveSettings::take(LiveSettings::show(other_server, other_mapper), server, mapper);
              }),
              "parameter " + name + " cannot change while mapping; set it and start again");
  }
}

TEST(LiveSettings, TakeWhatMayChangeAndRefuseTheRest) {
  ServerConfig server;
  MapperConfig mapper;
  MappingConfig config = LiveSettings::show(server, mapper);
  config.free_space_mode = "linear";
  config.sensor_model_max_range = 40.0;
  config.color_mode = "height";
  config.rules_together = 0.0;
  LiveSettings::take(config, server, mapper);
  EXPECT_EQ(mapper.free_space.mode, "linear");
  EXPECT_EQ(mapper.sensor_model.max_range, 40.0);
  EXPECT_EQ(mapper.rules.together, 0.0);
  EXPECT_EQ(server.color_mode, ColorMode::kHeight);
  config.resolution = 0.1;
  config.view_range = 7.0;
  const std::string refusal = refusalOf([&] { LiveSettings::take(config, server, mapper); });
  EXPECT_NE(refusal.find("resolution cannot change"), std::string::npos) << refusal;
  EXPECT_EQ(server.view_range, 0.0);
}

TEST(ServerConfig, ObstaclesOfDistanceSectionAreClassesOfTheTable) {
  SemanticClass car, road, sky;
  car.id = 4, road.id = 7, sky.id = 9;
  car.name = "car", road.name = "road", sky.name = "sky";
  road.ground = sky.ignored = true;
  const ClassTable table("three", {car, road, sky});
  DistanceSectionConfig config;
  EXPECT_EQ(obstaclesOf(config, table).classes, ClassFilter::allBut({7, 9}));
  config.classes = " road , car,";
  config.unknown = true;
  EXPECT_TRUE(obstaclesOf(config, table) == (ObstacleRules{{4, 7}, true}));
  config.classes = "car, trolley";
  const std::string refusal = refusalOf([&] { obstaclesOf(config, table); });
  const std::string words = "distance_section/classes: class table 'three' has no class 'trolley'";
  EXPECT_NE(refusal.find(words), std::string::npos) << refusal;
}

/// The names of topics and services in the code: the first string in advertise, advertiseService, offer and
/// subscribe.
std::set<std::string> namesInCode() {
  std::set<std::string> names;
  const std::regex call(
      R"re((?:(?:advertise|offer)\w*(?:<[^>]*>+)?|subscribe|CellMarkers>|UpdatePublisher)\( ?(?:context, )?"([\w/]+)")re");
  for (const auto& entry : fs::recursive_directory_iterator(kRoot / "src/ros")) {
    if (!entry.is_regular_file()) continue;
    const std::string text = std::regex_replace(textOf(entry.path()), std::regex("\\s+"), " ");
    for (std::sregex_iterator i(text.begin(), text.end(), call), end; i != end; ++i) names.insert((*i)[1]);
  }
  return names;
}

/// The names of topics and services in a document: in the first column of tables with their types in the
/// second.
std::set<std::string> namesInTables(const std::string& document) {
  std::set<std::string> names;
  const std::regex row(R"re(\n\| `~?(\w[\w/]*)` \| `\w+/\w+`)re");
  for (std::sregex_iterator i(document.begin(), document.end(), row), end; i != end; ++i) {
    names.insert((*i)[1]);
  }
  return names;
}

TEST(Documents, NameEveryTopicAndService) {
  std::set<std::string> names = namesInCode();
  names.insert(InputConfig().topic);
  EXPECT_GE(names.size(), 30u);
  EXPECT_EQ(names, namesInTables(textOf(kRoot / "docs/ros.md")));
}

TEST(Documents, HaveARowForEachReasonOfTheStatus) {
  const std::string document = textOf(kRoot / "docs/ros.md"),
                    message = textOf(kRoot / "msg/MappingStatus.msg");
  const std::regex field("uint64 ((dropped|points)_\\w+)");
  std::map<std::string, std::size_t> counts;
  for (std::sregex_iterator i(message.begin(), message.end(), field), end; i != end; ++i) {
    EXPECT_NE(document.find("\n| `" + (*i)[1].str() + "` |"), std::string::npos)
        << "docs/ros.md lacks " << (*i)[1];
    ++counts[(*i)[2]];
  }
  EXPECT_EQ(counts["dropped"], dropKinds().size());
  EXPECT_EQ(counts["points"], pointKinds().size() + 3);  // plus received, used, no_returns
}

TEST(Documents, EveryMessageFieldIsExplained) {
  for (const char* folder : {"msg", "srv"}) {
    for (const auto& entry : fs::directory_iterator(kRoot / folder)) {
      std::istringstream lines(textOf(entry.path()));
      for (std::string line; std::getline(lines, line);) {
        if (line.empty() || line == "---") continue;
        const bool comment = line.front() == '#';
        EXPECT_TRUE(comment || line.find('#') != std::string::npos) << entry.path() << ": " << line;
      }
      const std::string name = entry.path().stem().string();
      EXPECT_NE(textOf(kRoot / "docs/ros.md").find("`bki_mapping/" + name + "`"), std::string::npos)
          << "docs/ros.md lacks " << name;
    }
  }
}

}  // namespace
}  // namespace bki_mapping::ros_interface
