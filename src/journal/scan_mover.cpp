#include "journal/scan_mover.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>

#include "journal/scan_codec.h"

namespace bki_mapping {
namespace {

/// The map's settings, for a mapper on the side.
MapperConfig asideOf(MapperConfig config) {
  config.threads = 1;
  config.memory_limit = 0.0;
  return config;
}

/// Calls visit(region, block, looks) for the blocks of a map that were looked at.
template <typename Visit>
void forEachLooks(const SemanticMap& map, Visit&& visit) {
  for (const GridIndex& region : map.regions()) {
    const Region& blocks = *map.findRegion(region);
    blocks.forEachIndex([&](const BlockIndex& index) {
      const Looks& looks = blocks.find(Region::numberOf(index))->looks();
      if (!looks.empty()) visit(region, index, looks);
    });
  }
}

}  // namespace

std::vector<GridIndex> regionsOf(const std::vector<GridIndex>& blocks) {
  std::vector<GridIndex> regions;
  std::array<std::uint32_t, 256> last_seen = {};  // one more than the position of a region, by its hash
  for (const GridIndex& block : blocks) {
    const GridIndex region = SemanticMap::regionOf({block});
    std::uint32_t& seen = last_seen[GridIndexHash()(region) % last_seen.size()];
    if (seen != 0 && regions[seen - 1] == region) continue;
    regions.push_back(region);
    seen = static_cast<std::uint32_t>(regions.size());
  }
  std::sort(regions.begin(), regions.end());
  regions.erase(std::unique(regions.begin(), regions.end()), regions.end());
  return regions;
}

ScanMover::ScanMover(const MapperConfig& config, std::shared_ptr<const ClassTable> classes, Fetch fetch)
    : classes_(std::move(classes)),
      mapper_(std::make_unique<SemanticMapper>(asideOf(config), classes_)),
      fetch_(std::move(fetch)) {}

SensorScan ScanMover::unpack(const PlacedJournalScan& scan) const {
  return unpackScan(scan.packed ? *scan.packed : fetch_(scan.number));
}

void ScanMover::use(const PlacedJournalScan& scan) {
  if (settings_ == scan.settings) return;
  const MapperConfig aside = asideOf(*scan.settings);
  try {
    mapper_->reconfigure(aside);
  } catch (const std::invalid_argument&) {  // as of scans of a drive that began with other settings
    mapper_ = std::make_unique<SemanticMapper>(aside, classes_);
  }
  settings_ = scan.settings;
}

ScanMover::Moved ScanMover::move(const std::vector<ScanMove>& moves) {
  mapper_->takeMap();  // what a failed call has left
  std::vector<std::vector<GridIndex>> regions;
  std::vector<SensorScan> scans;
  for (const ScanMove& move : moves) {
    use(move.scan);
    scans.push_back(unpack(move.scan));
    mapper_->integrate(place(scans.back(), move.to));
    regions.push_back(regionsOf(mapper_->touchedBlocks()));
  }
  const std::vector<Eigen::AlignedBox3d> cleared =
      moves.empty() ? std::vector<Eigen::AlignedBox3d>() : moves.front().scan.cleared;
  for (const Eigen::AlignedBox3d& box : cleared) mapper_->clearBox(box);
  // Before anything is withdrawn: a block whose evidence is then 0 loses its looks.
  LooksByRegion looks;
  forEachLooks(mapper_->map(), [&](const GridIndex& region, const BlockIndex& block, const Looks& seen) {
    looks[region][block] = seen;
  });
  for (std::size_t n = 0; n < moves.size(); ++n) {
    mapper_->withdraw(place(scans[n], moves[n].scan.T_map_sensor));
  }
  Moved moved{mapper_->takeMap(), std::move(looks), std::move(regions)};
  for (const Eigen::AlignedBox3d& box : cleared) clearBox(moved.difference, box);
  return moved;
}

void ScanMover::addLooks(const PlacedJournalScan& scan, LooksByRegion& looks) {
  use(scan);
  mapper_->takeMap();  // what a failed call has left
  mapper_->integrate(place(unpack(scan), scan.T_map_sensor));
  for (const Eigen::AlignedBox3d& box : scan.cleared) mapper_->clearBox(box);
  forEachLooks(mapper_->map(), [&](const GridIndex& region, const BlockIndex& block, const Looks& seen) {
    const auto to = looks.find(region);
    if (to != looks.end()) to->second[block].add(seen);
  });
}

}  // namespace bki_mapping
