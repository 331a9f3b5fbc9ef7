/// @file Exports maps as pages for browsers.
#pragma once

#include <string>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/rules/voxel_state.h"
#include "bki_mapping/store/map_file.h"
#include "sequence/trajectory_file.h"

namespace bki_mapping {

/// What a page shows, beside the voxels.
struct HtmlOptions {
  /// Of the voxels in the page.
  VoxelStates states{VoxelState::kFree, VoxelState::kOccupied, VoxelState::kOccluded};
  std::string name;   ///< of the map, for people
  std::string frame;  ///< name of the map frame
  std::vector<DriveRecord> drives;
  MapFile* parts = nullptr;  ///< the file that holds these drives, each in its part; may be nullptr
  std::vector<Trajectory> trajectories;
  std::string three_js;  ///< path of three.js; "": where libjs-three installs it
};

/// Most voxels in a page. Chromium takes a few seconds and 0.6 GB for a page near this limit, most of it free
/// space; if all were occupied, they would need 1.1 GB of the graphics card.
constexpr std::size_t kMostHtmlVoxels = 20'000'000;
/// Greatest extent of the map in a page, along each axis [voxels].
constexpr int kMostHtmlExtent = 1 << 20;

/// Writes a page by AtomicFile that shows a map, and works without a server and without a network. It holds
/// three.js, the files of web/, and the map: the states of all voxels, their evidence as in map files, and
/// what is computed from it to colour them. web/map.js reads it.
/// @throws std::invalid_argument if the map is too large for a page, std::runtime_error if the page cannot be
/// written, and as checkHtml().
void exportHtml(const std::string& path, const SemanticMap& map, const StateRules& rules,
                const ClassTable& classes, const HtmlOptions& options);

/// Checks before long work that all parts of the page are there.
/// @throws std::runtime_error that says what to install.
void checkHtml(const HtmlOptions& options);

}  // namespace bki_mapping
