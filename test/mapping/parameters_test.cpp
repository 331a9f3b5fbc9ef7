// Parameters: names, refusals, files, and that documents agree with the code.
#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <sstream>

#include "bki_mapping/io/config_yaml.h"
#include "bki_mapping/mapping/parameters.h"
#include "free_space/registry.h"
#include "temporary_folder.h"

namespace bki_mapping {
namespace {

std::string messageOf(const std::map<std::string, std::string>& values) {
  MapperConfig config;
  try {
    setParameters(config, values);
  } catch (const std::invalid_argument& fault) {
    return fault.what();
  }
  return "";
}

std::string textOf(const std::string& file) {
  std::ifstream in(std::string(BKI_MAPPING_SOURCE_DIR) + "/" + file);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

TEST(Parameters, DefaultsAreThePapers) {
  const MapperConfig config;
  EXPECT_EQ(config.resolution, 0.3);
  EXPECT_EQ(config.kernel.lengthFor(config.resolution), 0.3);
  EXPECT_EQ(config.kernel.scale, 0.1);
  EXPECT_EQ(config.prior, 0.001);
  EXPECT_EQ(config.downsample_resolution, 0.1);
}

TEST(Parameters, SetAndGetEveryOne) {
  for (const Parameter& p : mapperParameters()) {
    MapperConfig config;
    const std::string value = p.get(config);
    p.set(config, value);
    EXPECT_EQ(p.get(config), value) << p.name;
    EXPECT_FALSE(p.description.empty()) << p.name;
  }
  MapperConfig config;
  setParameters(config, {{"resolution", "0.125"},
                         {"kernel/type", "counting"},
                         {"free_space/mode", "linear"},
                         {"clear_beyond_max_range", "false"},
                         {"free_space/seed", "9007199254740991"}});
  EXPECT_EQ(config.resolution, 0.125);
  EXPECT_EQ(config.kernel.type, KernelType::kCounting);
  EXPECT_FALSE(config.clear_beyond_max_range);
  EXPECT_EQ(config.free_space.seed, 9007199254740991);
}

TEST(Parameters, RefusesAllFaultsInOneMessage) {
  const std::string message =
      messageOf({{"resolutoin", "0.1"}, {"kernel/type", "spars"}, {"prior", "0"}, {"threads", "1.5"}});
  for (const char* words : {"'resolutoin' is unknown; did you mean 'resolution'?", "did you mean 'sparse'?",
                            "prior is '0'", "threads is '1.5'"}) {
    EXPECT_NE(message.find(words), std::string::npos) << words << "\n" << message;
  }
  for (const char* bad : {"", "abc", "1x", "nan", "inf", "-1", "0"}) {
    EXPECT_NE(messageOf({{"resolution", bad}}), "") << "resolution " << bad;
  }
}

TEST(Parameters, AFaultChangesNothing) {
  MapperConfig config;
  EXPECT_THROW(setParameters(config, {{"prior", "0.5"}, {"resolution", "x"}}), std::invalid_argument);
  EXPECT_EQ(config.prior, 0.001);
}

TEST(Parameters, ModesInTheTextAreTheRegistrys) {
  for (const Parameter& p : mapperParameters()) {
    if (p.name != "free_space/mode") continue;
    std::istringstream words(p.values.substr(std::string("one of ").size()));
    std::vector<std::string> names;
    for (std::string word; std::getline(words >> std::ws, word, ',');) names.push_back(word);
    std::sort(names.begin(), names.end());
    EXPECT_EQ(names, freeSpaceModes());
  }
  FreeSpaceSetup setup = {{}, GridGeometry(0.3), {}, 0.1};
  setup.config.mode = "liner";
  try {
    makeFreeSpaceModel(setup);
    FAIL();
  } catch (const std::invalid_argument& fault) {
    EXPECT_NE(std::string(fault.what()).find("known modes: even, line, linear, none, uniform"),
              std::string::npos);
  }
}

TEST(Parameters, TheDefaultFileIsWhatTheCodePrints) {
  const std::string file = textOf("config/default.yaml");
  EXPECT_EQ(file.substr(file.find('\n') + 1), parameterYaml(MapperConfig()));
  MapperConfig config;
  config.prior = 5.0;
  setParameters(config, loadParameterFile(std::string(BKI_MAPPING_SOURCE_DIR) + "/config/default.yaml"));
  EXPECT_EQ(parameterYaml(config), parameterYaml(MapperConfig()));
}

TEST(Parameters, TheDocumentHasARowForEach) {
  const std::string document = textOf("docs/parameters.md");
  for (const Parameter& p : mapperParameters()) {
    const std::string row = "| `" + p.name + "` | `" + p.get(MapperConfig()) + "` | " + p.unit + " | " +
                            p.values + " | " + p.description + " |\n";
    EXPECT_NE(document.find(row), std::string::npos) << "docs/parameters.md lacks\n" << row;
  }
}

TEST(ParameterFile, NamesItsFaults) {
  const TemporaryFolder folder;
  const std::string file = folder / "file.yaml";
  const auto faultOf = [&](const std::string& text) -> std::string {
    std::ofstream(file) << text;
    try {
      loadParameterFile(file);
    } catch (const std::invalid_argument& fault) {
      return fault.what();
    }
    return "";
  };
  EXPECT_EQ(faultOf(""), "");
  EXPECT_EQ(faultOf("kernel: {length: 0.2}\n"), "");
  EXPECT_NE(faultOf("prior: [1, 2]\n").find("'prior' must have one value"), std::string::npos);
  EXPECT_NE(faultOf("just text\n").find("must be a map"), std::string::npos) << faultOf("just text\n");
  const auto names = [&](const std::string& text, const std::string& words) {
    EXPECT_NE(faultOf(text).find(words), std::string::npos) << text << "says '" << faultOf(text) << "'";
  };
  names("prior: 0.1\nprior: 0.2\n", "'prior' is given twice");
  names("kernel: {length: 0.2, length: 0.2}\n", "'length' is given twice");
  names("kernel/length: 0.3\nkernel: {length: 0.2}\n", "'kernel/length' is given twice");
  names("kernel: {length: 0.2}\nkernel: {scale: 0.1}\n", "'kernel' is given twice");
  EXPECT_EQ(faultOf("kernel: {length: 0.2}\nkernel/scale: 0.1\n"), "");
  EXPECT_NE(faultOf("prior: [1\n").find(file), std::string::npos);
  EXPECT_THROW(loadParameterFile("/no/such/file.yaml"), std::invalid_argument);
}

}  // namespace
}  // namespace bki_mapping
