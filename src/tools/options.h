/// @file Command lines of the programs: common options, parsing and errors.
#pragma once

#include <Eigen/Geometry>
#include <boost/program_options.hpp>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/mapping/mapper_config.h"

namespace bki_mapping::tools {

namespace po = boost::program_options;

/// Parses a command line of named options; adds --help and --version. An unknown option is refused by name,
/// with the most similar known one.
/// @param positional name under which the words that belong to no option are found, as a vector of strings;
/// "": there must be none.
/// @return nullptr if the help or the version was printed. @throws std::invalid_argument in one sentence.
std::unique_ptr<po::variables_map> parse(int argc, char** argv, const std::string& what,
                                         po::options_description options, const std::string& positional = "");

/// An option with a text. @param value its name in the help.
po::typed_value<std::string>* textOption(const char* value);
/// An option with a default. @param value its name in the help.
template <typename T>
po::typed_value<T>* optionWith(const char* value, const T& standard) {
  return po::value<T>()->value_name(value)->default_value(standard);
}
/// An option with an integer from `least` to `most`, read with count(). parse() refuses any other value,
/// naming the option.
po::typed_value<std::int64_t>* countOption(const std::string& option, std::int64_t least,
                                           std::int64_t most = std::numeric_limits<std::int64_t>::max());
/// The same for a real number.
po::typed_value<double>* realOption(const std::string& option, double least,
                                    double most = std::numeric_limits<double>::max());
/// The value of a countOption.
std::size_t count(const po::variables_map& given, const std::string& name);

/// The only word that parse() has found as "files". @throws std::invalid_argument if there is none, or more
/// than one.
std::string onlyMapFile(const po::variables_map& given);

/// The box of an option --box "X0 Y0 Z0 X1 Y1 Z1": two opposite corners, which may be infinite.
/// @throws std::invalid_argument if it is not six numbers.
Eigen::AlignedBox3d parseBox(const std::string& text);

/// The option --memory-limit of programs that read a TiledMap, and its value [bytes]; 0: no limit.
void addMemoryLimit(po::options_description& options);
std::size_t memoryLimit(const po::variables_map& given);

/// Options of all programs with a mapper: --classes, --config, --set, --threads.
po::options_description mapperOptions();
/// The configuration that these options give. Prints a warning to standard error for questionable settings.
/// @throws std::invalid_argument.
MapperConfig mapperConfig(const po::variables_map& given);
/// The parameters, by name, that --set and --threads give. @throws std::invalid_argument if one is given
/// twice.
std::map<std::string, std::string> givenSettings(const po::variables_map& given);
/// Replaces some of the settings. @param option that gives them, for errors. @param settings NAME=VALUE,...
/// @throws std::invalid_argument.
MapperConfig withSettings(MapperConfig config, const std::string& option, const std::string& settings);
std::shared_ptr<const ClassTable> classTable(const po::variables_map& given);

/// Runs a program; an exception becomes one line on standard error and exit status 1, or that of Stopped.
int run(const std::string& program, const std::function<int()>& body);
/// The same for a body that is given what parse() makes of the command line.
int run(int argc, char** argv, const std::string& program, const std::string& what,
        const po::options_description& options, const std::function<int(const po::variables_map&)>& body,
        const std::string& positional = "");

/// Prints a sentence on standard error as a warning; nothing if it is empty.
void warn(const std::string& sentence);

/// A progress bar on standard error if that is a terminal, nothing otherwise.
void showProgress(std::size_t done, std::size_t all, const std::string& text);

}  // namespace bki_mapping::tools
