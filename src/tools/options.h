/// @file Command lines: one way to parse them and to fail.
#pragma once

#include <boost/program_options.hpp>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/io/sequence.h"
#include "bki_mapping/mapping/mapper_config.h"

namespace bki_mapping::tools {

namespace po = boost::program_options;

/// Parses a command line that has named options only; adds --help. A misspelt option is refused by name, with
/// the nearest known one.
/// @return nothing if help was asked for (and printed). @throws std::invalid_argument in one sentence.
std::unique_ptr<po::variables_map> parse(int argc, char** argv, const std::string& what,
                                         po::options_description options);

/// An option that takes a whole number, read with count(). parse() refuses other words and numbers out of the
/// limits, NaN and signs too, by the option's name.
po::typed_value<std::int64_t>* countOption(const std::string& option, std::int64_t least,
                                           std::int64_t most = std::numeric_limits<std::int64_t>::max());
/// The same for a number.
po::typed_value<double>* realOption(const std::string& option, double least,
                                    double most = std::numeric_limits<double>::max());
/// The value of a countOption.
std::size_t count(const po::variables_map& given, const std::string& name);

/// Options that tools with a mapper share: --classes, --config, --set, --threads.
po::options_description mapperOptions();
/// The settings that those options ask for; warns on standard error of those that are hardly meant.
/// @throws std::invalid_argument.
MapperConfig mapperConfig(const po::variables_map& given);
std::shared_ptr<const ClassTable> classTable(const po::variables_map& given);

/// Options that tools with a sequence share: --sequence, --labels, --first, --scans.
po::options_description sequenceOptions();
/// The sequence asked for; says on standard error which scans are missing. @throws std::invalid_argument if
/// --sequence is missing, std::runtime_error as Sequence.
Sequence openSequence(const po::variables_map& given);
/// The places of the frames asked for, from first to before last. @throws std::invalid_argument if there are
/// none.
std::pair<std::size_t, std::size_t> frameRange(const po::variables_map& given, const Sequence& sequence);

/// Runs a program; an exception becomes one line on standard error and exit status 1.
int run(const std::string& program, const std::function<int()>& body);

/// A progress bar on standard error if that is a terminal, nothing otherwise.
void showProgress(std::size_t done, std::size_t all, const std::string& text);

}  // namespace bki_mapping::tools
