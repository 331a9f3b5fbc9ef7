/// @file The settings in the journal of a map file: with what its scans were integrated.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/mapping/mapper_config.h"
#include "bki_mapping/store/map_file.h"

namespace bki_mapping {

/// The settings as a journal stores them (MapFile::Change::addSettings): the parameters and, as
/// `class_table/...`, what a map file does not say of the class table.
std::string settingsText(const MapperConfig& config, const ClassTable& classes);

/// The settings of a file's journal, by their numbers. @throws MapFileError if they are not YAML, not
/// allowed, or not known to this version.
std::vector<std::shared_ptr<const MapperConfig>> journalSettings(MapFile& file);

/// The class table with which the scans of a file's journal were integrated: that of the file with the flags
/// that the settings know. @throws MapFileError if it was another one for some of the scans, which then
/// cannot be moved; if the settings are not YAML.
std::shared_ptr<const ClassTable> journalClasses(MapFile& file);

}  // namespace bki_mapping
