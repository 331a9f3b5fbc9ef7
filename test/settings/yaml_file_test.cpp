// Untrusted YAML: any text is read or refused within a short time.
#include "settings/yaml_file.h"

#include <gtest/gtest.h>

#include <fstream>

#include "bki_mapping/settings/yaml.h"
#include "core/stopwatch.h"
#include "refusal_of.h"
#include "temporary_folder.h"

namespace bki_mapping {
namespace {

class YamlFile : public testing::Test {
 protected:
  void write(const std::string& text) { std::ofstream(path_, std::ios::binary) << text; }
  std::string faultOf(const std::string& text) {
    write(text);
    return refusalOf<YAML::Exception>([&] { loadYamlFile(path_); });
  }
  void expectFault(const std::string& text, const std::string& words) {
    Stopwatch watch;
    const std::string fault = faultOf(text), start = text.substr(0, 60);
    EXPECT_LT(watch.lap(), 5000.0) << start;
    EXPECT_NE(fault, "") << start;
    EXPECT_NE(fault.find(words), std::string::npos) << start << "\nsays '" << fault << "'";
    EXPECT_EQ(fault.find('\n'), std::string::npos) << fault;
  }
  static std::string repeated(const std::string& text, std::size_t times) {
    std::string all;
    while (times-- > 0) all += text;
    return all;
  }

  TemporaryFolder folder_;
  std::string path_ = folder_ / "file.yaml";
};

/// Each level contains the previous one nine times: 9^levels nodes if all were created ("billion laughs").
std::string laughs(int levels) {
  std::string text = "l0: &l0 [x, x, x, x, x, x, x, x, x]\n";
  for (int level = 1; level < levels; ++level) {
    const std::string name = "l" + std::to_string(level), below = "*l" + std::to_string(level - 1);
    text += name + ": &" + name + " [" + below;
    for (int i = 1; i < 9; ++i) text += ", " + below;
    text += "]\n";
  }
  return text;
}

TEST_F(YamlFile, OrdinaryFilesAreRead) {
  EXPECT_EQ(faultOf(""), "");
  EXPECT_EQ(faultOf("# nothing\n"), "");
  EXPECT_EQ(faultOf("---\na: 1\n...\n"), "");
  write("a: &a {b: 1}\nc: *a\nd: [*a, *a]\n");
  const YAML::Node root = loadYamlFile(path_);
  EXPECT_EQ(root["c"]["b"].as<int>(), 1);
  EXPECT_EQ(root["d"][1]["b"].as<int>(), 1);
}

TEST_F(YamlFile, AnAliasToWhatItIsInIsRefused) {
  expectFault("a: &a {b: *a}\n", "alias");
  expectFault("&a [*a]\n", "alias");
  expectFault("a: &a [&b [*a]]\n", "alias");
  expectFault("&a ? *a : x\n", "");
}

TEST_F(YamlFile, NestedAliasesAreCountedBeforeTheyAreFollowed) {
  EXPECT_EQ(faultOf(laughs(3)), "");
  expectFault(laughs(10), "nodes");
  expectFault(laughs(300), "nodes");  // more nodes than any integer can count
}

TEST_F(YamlFile, DeepNestingIsRefused) {
  for (const std::size_t depth : {std::size_t{40}, std::size_t{1000}, std::size_t{120000}}) {
    expectFault(repeated("[", depth) + repeated("]", depth), "levels");
    expectFault(repeated("{a: ", depth) + repeated("}", depth), "levels");
    expectFault(repeated("[{a: ", depth) + repeated("}]", depth), "levels");
    expectFault(repeated("- ", depth) + "x", "levels");
    for (const char* unclosed : {"[", "{a: ", "? ", "[{", "{[", "{? ", "- ? "}) {
      expectFault(repeated(unclosed, depth), "line 1");
    }
  }
  // Deep by aliases, too: each contains the previous one.
  std::string text = "a0: &a0 [x]\n";
  for (int i = 1; i < 40; ++i) {
    text += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [*a" + std::to_string(i - 1) + "]\n";
  }
  expectFault(text, "levels");
}

TEST_F(YamlFile, LargeFilesAndEndlessOnesAreRefused) {
  expectFault("a: 1\n#" + std::string(2000000, 'x') + "\n", "larger than");
  EXPECT_THROW(loadYamlFile("/dev/zero"), YAML::Exception);
  EXPECT_THROW(loadYamlFile(folder_ / ""), YAML::Exception);
  EXPECT_THROW(loadYamlFile(folder_ / "none"), YAML::Exception);
  expectFault("[" + repeated("1,", 400000) + "1]", "nodes");
}

TEST_F(YamlFile, SlowTextIsRefusedInTime) {
  for (const char* piece : {"a: &a ", "!!x ", "&a ", "'", "\"\\", "%YAML ", "\t", "? a\n", ": ", "|\n ",
                            "a\n", "- - ", "[a, ", "{a, ", "--- ", "\xff\xfe", "*a ", "a: b: "}) {
    Stopwatch watch;
    faultOf(repeated(piece, 900000 / std::string(piece).size()));
    EXPECT_LT(watch.lap(), 5000.0) << piece;
  }
}

TEST_F(YamlFile, KeysMustBeOnceAndPlain) {
  expectFault("a: 1\nb: {c: 1, c: 2}\n", "line 2: 'c' is given twice");
  expectFault("a: 1\n'a': 2\n", "'a' is given twice");
  expectFault("? [a]\n: 1\n", "key");
  expectFault("? {a: 1}\n: 1\n", "key");
  expectFault("a: &x b\n*x : 1\n", "key");
  EXPECT_EQ(faultOf("a: {c: 1}\nb: {c: 2}\n"), "");
}

TEST_F(YamlFile, NothingIsLeftOutInSilence) {
  expectFault("a: 1\n---\na: 2\n", "one document");
  expectFault("a: 1\n...\nb: 2\n", "one document");
}

TEST_F(YamlFile, AllReadersUseIt) {
  write("a: &a {b: *a}\n");
  EXPECT_THROW(loadParameterFile(path_), std::invalid_argument);
  EXPECT_THROW(loadClassTable(path_), std::invalid_argument);
}

}  // namespace
}  // namespace bki_mapping
