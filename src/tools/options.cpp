#include "tools/options.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <sstream>
#include <stdexcept>

#include "bki_mapping/city/tiled_map.h"
#include "bki_mapping/mapping/mapper_config.h"
#include "bki_mapping/settings/yaml.h"
#include "store/schema.h"
#include "tools/interruption.h"

namespace bki_mapping::tools {
namespace {

template <typename Number>
po::typed_value<Number>* limited(const std::string& option, Number least, Number most) {
  return po::value<Number>()->notifier([=](Number number) {
    if (number >= least && number <= most) return;
    const bool open = most == std::numeric_limits<Number>::max();
    const auto text = [](Number n) { return numberText(static_cast<double>(n)); };
    const std::string limits = open ? "at least " + text(least) : "from " + text(least) + " to " + text(most);
    throw std::invalid_argument(option + " is " + text(number) + ", but must be " + limits);
  });
}

}  // namespace

po::typed_value<std::string>* textOption(const char* value) {
  return po::value<std::string>()->value_name(value);
}

po::typed_value<std::int64_t>* countOption(const std::string& option, std::int64_t least, std::int64_t most) {
  return limited(option, least, most);
}

po::typed_value<double>* realOption(const std::string& option, double least, double most) {
  return limited(option, least, most);
}

std::size_t count(const po::variables_map& given, const std::string& name) {
  return static_cast<std::size_t>(given[name].as<std::int64_t>());
}

std::unique_ptr<po::variables_map> parse(int argc, char** argv, const std::string& what,
                                         po::options_description options, const std::string& positional) {
  options.add_options()("help,h", "print this help")("version", "print the version");
  po::options_description all = options;
  po::positional_options_description words;
  if (!positional.empty()) {
    all.add_options()(positional.c_str(), po::value<std::vector<std::string>>());
    words.add(positional.c_str(), -1);
  }
  auto given = std::make_unique<po::variables_map>();
  try {
    const int style = po::command_line_style::default_style & ~po::command_line_style::allow_guessing;
    const auto parsed = po::command_line_parser(argc, argv).options(all).positional(words).style(style).run();
    po::store(parsed, *given);
    if (given->count("help")) {
      std::cout << what << "\n\n" << options;
      return nullptr;
    }
    if (given->count("version")) {
      std::cout << programName() << "\n";
      return nullptr;
    }
    po::notify(*given);
  } catch (const po::unknown_option& error) {
    std::vector<std::string> known;
    for (const auto& option : options.options()) known.push_back("--" + option->long_name());
    const std::string name = error.get_option_name();
    throw std::invalid_argument("option '" + name + "' is unknown" + nearestWord(name, known) +
                                " (see --help)");
  } catch (const po::error& error) {
    throw std::invalid_argument(std::string(error.what()) + " (see --help)");
  }
  return given;
}

std::string onlyMapFile(const po::variables_map& given) {
  if (given.count("files") > 0) {
    const auto files = given["files"].as<std::vector<std::string>>();
    if (files.size() == 1) return files[0];
  }
  throw std::invalid_argument("name one map file (see --help)");
}

Eigen::AlignedBox3d parseBox(const std::string& text) {
  std::istringstream words(text);
  std::vector<double> numbers;
  for (std::string word; words >> word;) {
    std::size_t end = 0;
    try {
      numbers.push_back(std::stod(word, &end));
    } catch (const std::logic_error&) {
      end = 0;
    }
    if (end != word.size() || std::isnan(numbers.back()))
      throw std::invalid_argument("--box: " + word + " is not a number");
  }
  if (numbers.size() != 6) {
    throw std::invalid_argument("--box has " + std::to_string(numbers.size()) +
                                " numbers, but needs six: \"X0 Y0 Z0 X1 Y1 Z1\"");
  }
  const Eigen::Vector3d a(numbers[0], numbers[1], numbers[2]), b(numbers[3], numbers[4], numbers[5]);
  return {a.cwiseMin(b), a.cwiseMax(b)};
}

void addMemoryLimit(po::options_description& options) {
  constexpr std::int64_t kMegabyte = 1'000'000;
  options.add_options()("memory-limit",
                        countOption("--memory-limit", 0, 1'000'000'000)
                            ->value_name("MB")
                            ->default_value(static_cast<std::int64_t>(TiledMap::kUsualLimit) / kMegabyte),
                        "refuse to read more of the map than this into memory; 0: no limit");
}

std::size_t memoryLimit(const po::variables_map& given) {
  return 1'000'000 * count(given, "memory-limit");
}

po::options_description mapperOptions() {
  po::options_description options("Mapper");
  options.add_options()("classes",
                        po::value<std::string>()->default_value("semantic_kitti")->value_name("NAME|FILE"),
                        "class table: a name in config/classes, or a YAML file")(
      "config", po::value<std::string>()->value_name("NAME|FILE"),
      "parameters: a preset in config/presets, or a YAML file")(
      "set", po::value<std::vector<std::string>>()->value_name("NAME=VALUE")->composing(),
      "set a parameter, overriding --config; repeatable, once per parameter")(
      "threads", po::value<std::string>()->value_name("N"), "threads of the map update; 0: all cores");
  return options;
}

namespace {

/// Adds a setting NAME=VALUE. @param option that gives it, for errors.
void addSetting(const std::string& option, const std::string& setting,
                std::map<std::string, std::string>& values) {
  const std::size_t equals = setting.find('=');
  if (equals == std::string::npos) {
    throw std::invalid_argument(option + " " + setting + " has no '='; write " + option + " name=value");
  }
  const std::string name = setting.substr(0, equals);
  if (!values.emplace(name, setting.substr(equals + 1)).second) {
    throw std::invalid_argument(option + " " + name + " is given twice; keep one");
  }
}

}  // namespace

std::map<std::string, std::string> givenSettings(const po::variables_map& given) {
  std::map<std::string, std::string> values;
  if (given.count("set")) {
    for (const std::string& setting : given["set"].as<std::vector<std::string>>()) {
      addSetting("--set", setting, values);
    }
  }
  if (given.count("threads") && !values.emplace("threads", given["threads"].as<std::string>()).second) {
    throw std::invalid_argument("parameter threads is given by --threads and by --set; keep one");
  }
  return values;
}

MapperConfig mapperConfig(const po::variables_map& given) {
  MapperConfig config;
  if (given.count("config")) setParameters(config, loadParameterFile(given["config"].as<std::string>()));
  setParameters(config, givenSettings(given));
  for (const std::string& warning : settingWarnings(config, *classTable(given))) warn(warning);
  return config;
}

MapperConfig withSettings(MapperConfig config, const std::string& option, const std::string& settings) {
  std::map<std::string, std::string> values;
  std::istringstream in(settings);
  for (std::string setting; std::getline(in, setting, ',');) addSetting(option, setting, values);
  setParameters(config, values);
  return config;
}

std::shared_ptr<const ClassTable> classTable(const po::variables_map& given) {
  return std::make_shared<const ClassTable>(loadClassTable(given["classes"].as<std::string>()));
}

int run(const std::string& program, const std::function<int()>& body) {
  try {
    return body();
  } catch (const Stopped& stopped) {
    std::cerr << (isatty(STDERR_FILENO) ? "\n" : "") << program << ": " << stopped.what() << "\n";
    return kStoppedStatus;
  } catch (const std::exception& error) {
    std::cerr << program << ": " << error.what() << "\n";
    return 1;
  }
}

int run(int argc, char** argv, const std::string& program, const std::string& what,
        const po::options_description& options, const std::function<int(const po::variables_map&)>& body,
        const std::string& positional) {
  return run(program, [&] {
    const auto given = parse(argc, argv, what, options, positional);
    return given ? body(*given) : 0;
  });
}

void warn(const std::string& sentence) {
  if (!sentence.empty()) std::cerr << "warning: " << sentence << "\n";
}

void showProgress(std::size_t done, std::size_t all, const std::string& text) {
  if (!isatty(STDERR_FILENO)) return;
  constexpr std::size_t kWidth = 30;
  const std::size_t filled = all == 0 ? kWidth : kWidth * done / all;
  std::cerr << "\r[" << std::string(filled, '#') << std::string(kWidth - filled, ' ') << "] " << done << "/"
            << all << " " << text << (done == all ? "\n" : "") << std::flush;
}

}  // namespace bki_mapping::tools
