// Parameters by name: which values are refused, which can change while mapping, and parameter files.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <set>
#include <tuple>

#include "bki_mapping/mapping/mapper_config.h"
#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/rules/voxel_state.h"
#include "bki_mapping/settings/yaml.h"
#include "free_space/free_space_model.h"
#include "other_value.h"
#include "reference/scenes.h"
#include "refusal_of.h"
#include "temporary_folder.h"

namespace bki_mapping {
namespace {

std::string messageOf(const std::map<std::string, std::string>& values) {
  MapperConfig config;
  return refusalOf([&] { setParameters(config, values); });
}

TEST(Parameters, DefaultsAreThePapers) {
  const MapperConfig config;
  EXPECT_EQ(config.resolution, 0.3);
  EXPECT_EQ(config.kernel.lengthFor(config.resolution), 0.3);
  EXPECT_EQ(config.kernel.scale, 0.1);
  EXPECT_EQ(config.prior, 0.001);
  EXPECT_EQ(config.downsample_resolution, 0.1);
}

TEST(Parameters, EachSetsItsOwnMemberAndNoOther) {
  expectOwnMembers(mapperParameters());
}

TEST(Parameters, HaveNamesOfTheirOwnAndDescriptionsInSentences) {
  expectNamesAndDescriptions(mapperParameters());
}

TEST(Parameters, TheLargestSeedIsExact) {
  MapperConfig config;
  setParameters(config, {{"free_space/seed", "9007199254740991"}});
  EXPECT_EQ(config.free_space.seed, 9007199254740991);
  EXPECT_NE(messageOf({{"free_space/seed", "9007199254740992"}}), "");
}

TEST(Parameters, AValueIsCheckedWhereverItComesFrom) {
  const auto refused = [](const auto& change) {
    MapperConfig config;
    change(config);
    return refusalOf([&] { checkParameters(config); });
  };
  EXPECT_EQ(refused([](MapperConfig&) {}), "");
  EXPECT_EQ(refused([](MapperConfig& c) { c.resolution = 0.0; }),
            "parameter resolution is '0', but must be a number from 0.001 to 1000");
  EXPECT_EQ(refused([](MapperConfig& c) { c.prior = std::nan(""); }),
            "parameter prior is 'nan', but must be a number > 0, at most 1e9");
  EXPECT_EQ(refused([](MapperConfig& c) { c.threads = -1; }),
            "parameter threads is '-1', but must be an integer from 0 to 1024");
  EXPECT_EQ(refused([](MapperConfig& c) { c.kernel.type = static_cast<KernelType>(7); }),
            "parameter kernel/type is '7', but must be one of sparse, counting");
  const std::string two = refused([](MapperConfig& c) {
    c.free_space.mode = "liner";
    c.sensor_model.max_range = -2.0;
  });
  EXPECT_NE(two.find("did you mean 'line'?"), std::string::npos) << two;
  EXPECT_NE(two.find("a number > 0, or -1 for not known"), std::string::npos) << two;
}

/// State, class, probability and evidence of each known voxel after a scan; empty if the mapper refuses it.
std::vector<std::tuple<int, int, int, VoxelState, ClassId, float, float>> knownAfterAScan(
    SemanticMapper& mapper) {
  try {
    mapper.integrate(reference::nastyScenes(100)[0].scan);
  } catch (const ScanRefused&) {
    return {};  // a limit of the scan or of the map
  }
  std::vector<std::tuple<int, int, int, VoxelState, ClassId, float, float>> known;
  forEachKnownVoxel(mapper.map(), mapper.rules(), [&](const VoxelIndex& v, const VoxelView& view) {
    known.emplace_back(v.x, v.y, v.z, view.state, view.label, view.probability, view.evidence);
  });
  return known;
}

TEST(Parameters, ThoseThatChangeWhileMappingTakeEffectAndTheOthersAreRefused) {
  const std::set<std::string> leaves_nothing = {"scan_limit/blocks", "memory_limit"};  // 7 blocks, 0.25 MB
  std::size_t changing = 0;
  for (const Parameter& p : mapperParameters()) {
    MapperConfig other;
    p.set(other, otherValue(p, other));
    SemanticMapper changed(MapperConfig(), reference::smallTable());
    if (p.changesWhileMapping()) {
      changed.reconfigure(other);
      EXPECT_TRUE(p.equal(changed.config(), other)) << p.name;
      SemanticMapper made(other, reference::smallTable());
      const auto known = knownAfterAScan(made);
      EXPECT_EQ(known.empty(), leaves_nothing.count(p.name) > 0) << p.name;
      EXPECT_TRUE(knownAfterAScan(changed) == known) << p.name;
      ++changing;
    } else {
      EXPECT_EQ(refusalOf([&] { changed.reconfigure(other); }),
                "parameter " + p.name + " cannot change while mapping; set it and start again");
      EXPECT_TRUE(p.equal(changed.config(), MapperConfig())) << p.name;
    }
  }
  EXPECT_GT(changing, 10u);
  EXPECT_LT(changing, mapperParameters().size());
}

TEST(Parameters, EvenADifferenceTooSmallToPrintIsAChange) {
  MapperConfig before, after;
  after.resolution = std::nextafter(before.resolution, 1.0);
  EXPECT_EQ(numberText(after.resolution), numberText(before.resolution));
  EXPECT_THROW(checkChanges(before, after), std::invalid_argument);
}

TEST(NumberText, IsAsPeopleWriteNumbers) {
  EXPECT_EQ(numberText(0.3), "0.3");
  EXPECT_EQ(numberText(-1.0), "-1");
  EXPECT_EQ(numberText(1e6), "1000000");
  EXPECT_EQ(numberText(9007199254740991.0), "9007199254740991");
  EXPECT_EQ(numberText(2.5e20), "2.5e20");
  EXPECT_EQ(numberText(1e-6), "1e-6");
  EXPECT_EQ(NumberRange::any().text("a number"), "a number");
  EXPECT_EQ(NumberRange::atLeast(0.0).text("a number"), "a number >= 0");
  EXPECT_EQ(NumberRange::atLeast(0.0).upTo(1e9).text("an integer"), "an integer from 0 to 1e9");
  EXPECT_EQ(NumberRange::above(0.0).orElse(-1.0, "none").text("a number"), "a number > 0, or -1 for none");
}

TEST(NumberRange, AllowsItsEndsAndItsOneOther) {
  const NumberRange closed = NumberRange::atLeast(1.0).upTo(2.0).orElse(0.0);
  const NumberRange open = NumberRange::above(1.0);
  EXPECT_TRUE(closed.allows(0.0) && closed.allows(1.0) && closed.allows(2.0));
  EXPECT_FALSE(closed.allows(0.5) || closed.allows(2.5) || closed.allows(std::nan("")));
  EXPECT_TRUE(open.allows(1.5));
  EXPECT_FALSE(open.allows(1.0) || open.allows(std::numeric_limits<double>::infinity()));
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

TEST(FreeSpaceModes, AnUnknownOneIsNamedWithTheKnown) {
  FreeSpaceSetup setup = {{}, GridGeometry(0.3), {}, 0.1};
  setup.config.mode = "liner";
  std::string sentence = "known modes: ";
  for (const std::string& mode : freeSpaceModes()) {
    sentence += (mode == freeSpaceModes().front() ? "" : ", ") + mode;
  }
  const std::string refusal = refusalOf([&] { makeFreeSpaceModel(setup); });
  EXPECT_NE(refusal.find(sentence), std::string::npos) << refusal;
  for (const char* mode : {"even", "line", "linear", "none", "uniform"}) {
    EXPECT_NE(sentence.find(mode), std::string::npos) << mode;
  }
}

TEST(ParameterFile, ThePrintedFileSetsEveryParameter) {
  const TemporaryFolder folder;
  MapperConfig written, read;
  for (const Parameter& p : mapperParameters()) p.set(written, otherValue(p, written));
  std::ofstream(folder / "file.yaml") << parameterYaml(written);
  setParameters(read, loadParameterFile(folder / "file.yaml"));
  for (const Parameter& p : mapperParameters()) EXPECT_TRUE(p.equal(read, written)) << p.name;
}

TEST(ParameterFile, NamesItsFaults) {
  const TemporaryFolder folder;
  const std::string file = folder / "file.yaml";
  const auto faultOf = [&](const std::string& text) {
    std::ofstream(file) << text;
    return refusalOf([&] { loadParameterFile(file); });
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
}

TEST(Parameters, OfEarlierVersionsAreRefusedWithWhatToSetInstead) {
  MapperConfig config;
  EXPECT_EQ(refusalOf([&] {
              setParameters(config, {{"resolution", "0.1"}, {"scan_limit/free_threshold", "0.01"}});
            }),
            "parameter scan_limit/free_threshold is no longer one; set sensor_model/height instead");
  EXPECT_EQ(config.resolution, 0.3);
}

TEST(Parameters, WithRulesVoxelsHoldWholeCells) {
  MapperConfig config;
  const auto cellOf = [&](double resolution, double downsample) {
    config.resolution = resolution;
    config.downsample_resolution = downsample;
    return applied(config).downsample_resolution;
  };
  EXPECT_EQ(cellOf(0.25, 0.1), 0.1);
  EXPECT_EQ(applied(config).prior, config.prior);
  config.rules.enabled = true;
  EXPECT_DOUBLE_EQ(cellOf(0.3, 0.1), 0.1);
  EXPECT_DOUBLE_EQ(cellOf(0.15, 0.1), 0.075);
  EXPECT_DOUBLE_EQ(cellOf(0.1, 0.1), 0.05);
  EXPECT_DOUBLE_EQ(cellOf(0.4, 0.2), 0.2);
  EXPECT_DOUBLE_EQ(cellOf(0.1, 5.0), 0.05);
  EXPECT_EQ(cellOf(0.3, 0.0), 0.0) << "every point is kept";
  EXPECT_LT(applied(config).prior, config.prior);
  EXPECT_EQ(applied(config).scan_limit.blocks, config.scan_limit.blocks);
}

TEST(ParameterFile, HasAPathOrTheNameOfAPreset) {
  const TemporaryFolder folder;
  std::ofstream(folder / "robot.yaml") << "prior: 0.5\n";
  EXPECT_EQ(loadParameterFile("robot").at("rules/enabled"), "true");
  EXPECT_EQ(loadParameterFile(folder / "robot.yaml").at("prior"), "0.5");
  const auto faultOf = [](const std::string& name) { return refusalOf([&] { loadParameterFile(name); }); };
  const std::string known =
      "neither a file nor one of baseline_even, paper_line, paper_linear, paper_none, robot";
  EXPECT_EQ(faultOf("robott"), "parameter file 'robott' is " + known + "; did you mean 'robot'?");
  EXPECT_EQ(faultOf("/no/such/robott.yaml"),
            "parameter file '/no/such/robott.yaml' is " + known + "; did you mean 'robot'?");
  const std::string here = std::filesystem::current_path().string();
  EXPECT_EQ(faultOf("robot.yaml"),
            "parameter file 'robot.yaml' (" + here + "/robot.yaml) is " + known + "; did you mean 'robot'?");
  EXPECT_EQ(faultOf("./xyzxyzxyz"), "parameter file './xyzxyzxyz' (" + here + "/xyzxyzxyz) is " + known);
  EXPECT_NE(faultOf("."), "") << "a folder is no file";
  EXPECT_NE(faultOf(""), "");
}

TEST(ParameterFile, HasTheTruthWordsOfYaml) {
  const TemporaryFolder folder;
  std::ofstream(folder / "file.yaml") << "a: True\nb: yes\nc: Off\nd: 'no'\ne: \"True\"\nf: y\n";
  EXPECT_EQ(loadParameterFile(folder / "file.yaml"),
            (std::map<std::string, std::string>{
                {"a", "true"}, {"b", "true"}, {"c", "false"}, {"d", "no"}, {"e", "True"}, {"f", "y"}}));
}

}  // namespace
}  // namespace bki_mapping
