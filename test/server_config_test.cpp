// The server's parameters, and that the documents name every one, and every topic, service and field.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>

#include "bki_mapping/ros/server_config.h"

namespace bki_mapping::ros_shell {
namespace {

namespace fs = std::filesystem;
const fs::path kRoot = BKI_MAPPING_SOURCE_DIR;

std::string textOf(const fs::path& file) {
  std::ifstream in(file);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
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
  try {
    setParameters({{"frame", "odom"}, {"queue_size", "0"}, {"prior", "x"}}, server, mapper);
    FAIL();
  } catch (const std::invalid_argument& fault) {
    const std::string text = fault.what();
    for (const char* words : {"'frame' is unknown", "queue_size is '0'", "prior is 'x'"}) {
      EXPECT_NE(text.find(words), std::string::npos) << text;
    }
  }
  EXPECT_EQ(mapper.prior, 0.5);
  EXPECT_THROW(setParameters({{"occupancy_min_z", "2"}, {"occupancy_max_z", "1"}}, server, mapper),
               std::invalid_argument);
}

TEST(Documents, HaveARowForEachServerParameter) {
  const std::string document = textOf(kRoot / "docs/parameters.md");
  for (const auto& p : serverParameters()) {
    const std::string row = "| `" + p.name + "` | `" + p.get(ServerConfig()) + "` | " + p.unit + " | " +
                            p.values + " | " + p.description + " |\n";
    EXPECT_NE(document.find(row), std::string::npos) << "docs/parameters.md lacks\n" << row;
  }
}

/// Topics and services as the code names them: the first text in advertise, advertiseService and subscribe.
std::set<std::string> namesInCode() {
  std::set<std::string> names;
  const std::regex call(
      R"re((?:advertise\w*(?:<[^>]*>+)?|subscribe|CellMarkers>)\((?:context, )?"([\w/]+)")re");
  for (const auto& entry : fs::recursive_directory_iterator(kRoot / "src/ros")) {
    if (!entry.is_regular_file()) continue;
    const std::string text = std::regex_replace(textOf(entry.path()), std::regex("\\s+"), " ");
    for (std::sregex_iterator i(text.begin(), text.end(), call), end; i != end; ++i) names.insert((*i)[1]);
  }
  return names;
}

TEST(Documents, NameEveryTopicAndService) {
  const std::string document = textOf(kRoot / "docs/ros.md");
  const std::set<std::string> names = namesInCode();
  EXPECT_EQ(names, (std::set<std::string>{"cloud_in", "free_cells_vis_array", "occupancy",
                                          "occupied_cells_vis_array", "projected_map", "reset", "save_map",
                                          "status", "trajectory", "voxel_cloud"}));
  for (const std::string& name : names) {
    const bool known = document.find("| `" + name + "` |") != std::string::npos ||
                       document.find("| `~" + name + "` |") != std::string::npos;
    EXPECT_TRUE(known) << "docs/ros.md lacks " << name;
  }
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
}  // namespace bki_mapping::ros_shell
