/// @file Options of programs that read a sequence.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>

#include "bki_mapping/sequence/sequence.h"
#include "tools/options.h"

namespace bki_mapping::tools {

/// --sequence, --labels, --poses-in, --first, --scans.
po::options_description sequenceOptions();

/// The sensor that --poses-in names; nullopt if it is not given. @throws std::invalid_argument if it is
/// unknown.
std::optional<PosesIn> posesIn(const po::variables_map& given);
/// What the options say of a sequence. Scans whose labels are missing have none if that makes no difference,
/// because the class table of the options has one class for all labels.
/// @throws std::invalid_argument if --sequence is missing, or an option is wrong.
SequenceOptions sequenceOptionsOf(const po::variables_map& given);
/// Opens the sequence of these options; reports missing scans on standard error.
/// @throws std::invalid_argument as sequenceOptionsOf(), std::runtime_error as Sequence.
Sequence openSequence(const po::variables_map& given);
/// The half-open range of indices that --first and --scans select. @throws std::invalid_argument if it is
/// empty, std::runtime_error if one of the scans has no pose or time.
std::pair<std::size_t, std::size_t> frameRange(const po::variables_map& given, const Sequence& sequence);
/// Warns on standard error if the scans of a range agree much better when their poses are read as those of
/// the other sensor, unless --poses-in is given.
void warnOfPoses(const po::variables_map& given, std::size_t first, std::size_t last);

}  // namespace bki_mapping::tools
