#include "export/html_export.h"

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "core/atomic_file.h"
#include "export/display_colors.h"
#include "export/html_page.h"
#include "export/voxel_drives.h"
#include "store/tile_codec.h"

namespace bki_mapping {
namespace {

using nlohmann::json;

/// What a page says about the map as a whole.
struct Count {
  std::array<std::size_t, 4> by_state{};
  std::array<std::size_t, 256> by_class{};
  GridIndex low{1 << 30, 1 << 30, 1 << 30}, high{-(1 << 30), -(1 << 30), -(1 << 30)};

  std::size_t all() const { return by_state[1] + by_state[2] + by_state[3]; }
};

std::string grouped(std::size_t number) {
  std::string text = std::to_string(number);
  for (int at = static_cast<int>(text.size()) - 3; at > 0; at -= 3) {
    text.insert(static_cast<std::size_t>(at), ",");
  }
  return text;
}

/// @throws std::invalid_argument if no browser could show that many.
Count countVoxels(const SemanticMap& map, const StateRules& rules, const VoxelStates& states) {
  Count count;
  BlockView view;
  for (const auto& [index, block] : map.entries()) {
    readBlock(map, rules, index, *block, BlockFields::kStates, view);
    for (int offset = 0; offset < kBlockVoxels; ++offset) {
      const auto v = static_cast<std::size_t>(offset);
      if (view.state[v] == VoxelState::kUnknown || !states.contains(view.state[v])) continue;
      ++count.by_state[static_cast<std::size_t>(view.state[v])];
      if (view.state[v] == VoxelState::kOccupied) ++count.by_class[view.label[v]];
      const VoxelIndex voxel = GridGeometry::voxelOf(index, offset);
      count.low = {std::min(count.low.x, voxel.x), std::min(count.low.y, voxel.y),
                   std::min(count.low.z, voxel.z)};
      count.high = {std::max(count.high.x, voxel.x), std::max(count.high.y, voxel.y),
                    std::max(count.high.z, voxel.z)};
    }
  }
  const char* const remedy =
      "; export a part of it with --box, or leave out free space with --include occupied";
  if (count.all() > kMostHtmlVoxels) {
    throw std::invalid_argument("the map has " + grouped(count.all()) + " voxels, but a page can show " +
                                grouped(kMostHtmlVoxels) + remedy);
  }
  if (count.all() == 0) {
    throw std::invalid_argument("there is no voxel to show; check --box and --include");
  }
  const int extent =
      std::max({count.high.x - count.low.x, count.high.y - count.low.y, count.high.z - count.low.z}) + 1;
  if (extent > kMostHtmlExtent) {
    throw std::invalid_argument("the map is " + grouped(static_cast<std::size_t>(extent)) +
                                " voxels long, but a page can show " +
                                grouped(static_cast<std::size_t>(kMostHtmlExtent)) + remedy);
  }
  return count;
}

std::string zlibStream(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string packed(size, '\0');
  if (compress2(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
                bytes.size(), Z_DEFAULT_COMPRESSION) != Z_OK) {
    throw std::bad_alloc();
  }
  packed.resize(size);
  return packed;
}

/// A probability as a byte.
char byteOf(float probability) {
  return static_cast<char>(
      static_cast<unsigned char>(std::lround(255.0f * std::clamp(probability, 0.0f, 1.0f))));
}

/// Writes the tiles of a map, and lists them.
class TileWriter {
 public:
  TileWriter(const SemanticMap& map, const StateRules& rules, const ClassTable& classes,
             const HtmlOptions& options, const PageWriter& write)
      : map_(map),
        rules_(rules),
        states_(options.states),
        drives_(options.drives, options.parts),
        codec_(classes, TileLayout::kNoLooks),  // pages show no looks
        write_(write) {}

  /// Planes of the voxels in the page.
  int planes() const { return drives_.any() ? 5 : 4; }

  /// Writes a tile: its voxels, and its evidence. @return its entry for the header; null if it has no voxels.
  json writeTile(const GridIndex& tile) {
    if (drives_.any()) drives_.readTile(tile);
    std::string numbers;
    std::array<std::string, 5> planes;
    SemanticMap left(map_.geometry(), map_.prior(), map_.classCount());  // without what is left out
    const Region region(tile);
    int blocks = 0;
    for (int number = 0; number < Region::kBlocks; ++number) {
      const BlockIndex index = region.blockIndex(number);
      const Block* const block = map_.find(index);
      if (!block || !readStates(index, *block)) continue;
      ++blocks;
      numbers += static_cast<char>(number & 0xff);
      numbers += static_cast<char>(number >> 8);
      appendPlanes(index, *block, planes);
      if (left_out_)
        keepShown(*block, left.getOrAllocate(index));
      else
        left.getOrAllocate(index) = *block;
    }
    if (blocks == 0) return nullptr;
    const TileEntry entry = codec_.pack(left, {tile});
    std::string voxels = numbers;
    for (int p = 0; p < this->planes(); ++p) voxels += planes[static_cast<std::size_t>(p)];
    write_("<script type=\"text/plain\" class=\"voxels\">" + base64(zlibStream(voxels)) + "</script>\n");
    write_("<script type=\"text/plain\" class=\"evidence\">" + base64(codec_.packed()) + "</script>\n");
    return {{"index", {tile.x, tile.y, tile.z}},
            {"blocks", blocks},
            {"evidence_blocks", entry.blocks},
            {"evidence_planes", entry.planes},
            {"evidence_checksum", entry.checksum}};
  }

 private:
  /// Reads a block, in which voxels that are left out become unknown. @return whether any voxel remains.
  bool readStates(const BlockIndex& index, const Block& block) {
    readBlock(map_, rules_, index, block, BlockFields::kAllButEntropy, view_);
    left_out_ = false;
    bool any = false;
    for (VoxelState& state : view_.state) {
      if (state == VoxelState::kUnknown) continue;
      if (states_.contains(state)) {
        any = true;
      } else {
        state = VoxelState::kUnknown;
        left_out_ = true;
      }
    }
    return any;
  }

  void appendPlanes(const BlockIndex& index, const Block& block, std::array<std::string, 5>& planes) {
    VoxelDrives::Codes codes{};
    if (drives_.any()) codes = drives_.codesOf(map_.geometry(), index, block, view_);
    for (std::size_t v = 0; v < kBlockVoxels; ++v) {
      const bool known = view_.state[v] != VoxelState::kUnknown;
      const bool occupied = view_.state[v] == VoxelState::kOccupied;
      planes[0] += static_cast<char>(view_.state[v]);
      planes[1] += static_cast<char>(known ? view_.label[v] : 0);
      planes[2] += known ? byteOf(view_.occupancy[v]) : '\0';
      planes[3] += occupied ? byteOf(view_.class_probability[v]) : '\0';
      planes[4] += static_cast<char>(codes[v]);
    }
  }

  /// Copies the evidence of the voxels that are not left out.
  void keepShown(const Block& block, Block& kept) const {
    for (const ClassId id : block.classes()) {
      const EvidenceUnits* const units = block.evidence(id);
      kept.change(id, [&](EvidenceUnits* plane) {
        bool any = false;
        for (std::size_t v = 0; v < kBlockVoxels; ++v) {
          plane[v] = view_.state[v] == VoxelState::kUnknown ? 0 : units[v];
          any = any || plane[v] != 0;
        }
        return any;
      });
    }
    Block::Occlusion marks = block.occlusion();
    for (std::size_t v = 0; v < kBlockVoxels; ++v) {
      if (view_.state[v] == VoxelState::kUnknown) marks[v] = false;
    }
    kept.setOcclusion(marks);
  }

  const SemanticMap& map_;
  const StateRules& rules_;
  VoxelStates states_;
  VoxelDrives drives_;
  TileCodec codec_;
  const PageWriter& write_;
  BlockView view_{};
  bool left_out_ = false;
};

json classList(const ClassTable& classes, const Count& count) {
  json list = json::array();
  const ClassTable shown = displayTable(classes);
  for (const SemanticClass& c : shown.classes()) {
    list.push_back({{"id", c.id}, {"name", c.name}, {"color", c.color}, {"voxels", count.by_class[c.id]}});
  }
  return list;
}

json trajectoryList(const std::vector<Trajectory>& trajectories) {
  json list = json::array();
  for (const Trajectory& trajectory : trajectories) {
    json points = json::array();
    for (const Eigen::Vector3d& point : trajectory.points) {
      const auto rounded = [](double metres) { return std::round(1000.0 * metres) / 1000.0; };
      points.push_back({rounded(point.x()), rounded(point.y()), rounded(point.z())});
    }
    list.push_back({{"name", trajectory.name}, {"points", std::move(points)}});
  }
  return list;
}

json headerOf(const SemanticMap& map, const ClassTable& classes, const HtmlOptions& options,
              const Count& count) {
  json drives = json::array();
  for (const DriveRecord& drive : options.drives) {
    drives.push_back({{"id", drive.id}, {"name", drive.name}, {"scans", drive.scans}});
  }
  const auto of = [&](VoxelState state) { return count.by_state[static_cast<std::size_t>(state)]; };
  return {{"name", options.name},
          {"frame", options.frame},
          {"resolution", map.geometry().resolution()},
          {"prior", map.prior()},
          {"unit_exponent", kUnitExponent},
          {"classes", classList(classes, count)},
          {"voxels",
           {{"free", of(VoxelState::kFree)},
            {"occupied", of(VoxelState::kOccupied)},
            {"occluded", of(VoxelState::kOccluded)}}},
          {"bounds",
           {{"min", {count.low.x, count.low.y, count.low.z}},
            {"max", {count.high.x, count.high.y, count.high.z}}}},
          {"drives", std::move(drives)},
          {"trajectories", trajectoryList(options.trajectories)}};
}

}  // namespace

void checkHtml(const HtmlOptions& options) {
  findThreeJs(options.three_js);
}

void exportHtml(const std::string& path, const SemanticMap& map, const StateRules& rules,
                const ClassTable& classes, const HtmlOptions& options) {
  const Count count = countVoxels(map, rules, options.states);
  AtomicFile file(path);
  const PageWriter write = [&](const std::string& bytes) { file.write(bytes); };
  writePage(options.three_js, write, [&] {
    TileWriter tiles(map, rules, classes, options, write);
    json header = headerOf(map, classes, options, count), list = json::array();
    for (const GridIndex& tile : tilesOf(map)) {
      json entry = tiles.writeTile(tile);
      if (!entry.is_null()) list.push_back(std::move(entry));
    }
    header["planes"] = tiles.planes();
    header["tiles"] = std::move(list);
    const std::string text = header.dump(-1, ' ', true, json::error_handler_t::replace);
    write("<script type=\"application/json\" id=\"map\">" + safeInHtml(text) + "</script>\n");
  });
  file.commit();
}

}  // namespace bki_mapping
