#include "bki_mapping/store/map_merge.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <map>
#include <memory>
#include <stdexcept>
#include <tuple>

#include "bki_mapping/store/map_file.h"
#include "store/drives.h"
#include "store/journal_merge.h"
#include "store/summand.h"

namespace bki_mapping {
namespace {

using Files = std::vector<std::shared_ptr<PlacedFile>>;

bool isSameFile(const std::string& a, const std::string& b) {
  std::error_code missing;
  return std::filesystem::equivalent(a, b, missing);
}

bool isSamePlace(const std::optional<MapPlacement>& a, const std::optional<MapPlacement>& b) {
  const MapPlacement x = a.value_or(MapPlacement()), y = b.value_or(MapPlacement());
  return x.translation == y.translation && x.yaw == y.yaw;
}

/// Opens each input once. The input that the result replaces is opened for update, so that it is locked.
Files openAll(const MergeOptions& options) {
  Files files;
  std::vector<const MergeInput*> opened;
  for (const MergeInput& input : options.inputs) {
    const bool repeated = std::any_of(opened.begin(), opened.end(), [&](const MergeInput* other) {
      return isSameFile(input.path, other->path) && isSamePlace(input.placement, other->placement);
    });
    if (repeated) continue;
    const bool replaced = isSameFile(input.path, options.output);
    MapFile file(input.path, replaced ? MapFile::Access::kUpdate : MapFile::Access::kRead);
    const GridTransform transform(input.placement.value_or(MapPlacement()), file.info().resolution);
    files.push_back(
        std::make_shared<PlacedFile>(PlacedFile{std::move(file), transform, input.placement.has_value()}));
    opened.push_back(&input);
  }
  if (files.empty()) throw std::invalid_argument("there is no map to merge; give the names of .bkm files");
  return files;
}

/// The frame of the result: that of the inputs without a placement; if all have one, their common frame.
std::string commonFrame(const Files& files) {
  const bool all_placed =
      std::all_of(files.begin(), files.end(), [](const auto& file) { return file->placed; });
  const PlacedFile* first = nullptr;
  for (const auto& file : files) {
    if (file->placed && !all_placed) continue;
    if (!first) first = file.get();
    if (file->file.info().frame == first->file.info().frame) continue;
    throw std::invalid_argument("the map in " + first->file.path() + " is in frame '" +
                                first->file.info().frame + "', and that in " + file->file.path() +
                                " in frame '" + file->file.info().frame +
                                "'; say where one lies in the frame of the other with --transform");
  }
  return first->file.info().frame;
}

/// The records of all drives by id: the files that contain the drive, and the record for the result.
using Records = std::map<std::string, std::vector<std::pair<const PlacedFile*, DriveRecord>>>;

Records recordsOf(const Files& files) {
  Records records;
  for (const auto& file : files) {
    for (DriveRecord record : file->file.drives()) {
      record.bounds = file->transform.apply(record.bounds);
      records[record.id].emplace_back(file.get(), record);
    }
  }
  return records;
}

MapFileError notTheSame(const std::string& id, const std::string& a, const std::string& b,
                        const std::string& how) {
  return MapFileError("drive '" + id + "' is not the same in " + a + " and " + b + ": " + how +
                      "; leave it out of one of them first (--without)");
}

void checkSameDrives(const Records& records) {
  for (const auto& [id, found] : records) {
    const auto& [first_file, first] = found.front();
    for (const auto& [file, record] : found) {
      if (record.scans == first.scans && record.first_stamp == first.first_stamp &&
          record.last_stamp == first.last_stamp) {
        continue;
      }
      throw notTheSame(id, first_file->file.path(), file->file.path(),
                       "it has " + std::to_string(first.scans) + " scans in the one and " +
                           std::to_string(record.scans) + " in the other, or other stamps");
    }
  }
}

/// Drives in one file have been added knowingly.
bool areInOneFile(const Records::mapped_type& a, const Records::mapped_type& b) {
  return std::any_of(a.begin(), a.end(), [&](const auto& of_a) {
    return std::any_of(b.begin(), b.end(), [&](const auto& of_b) { return of_a.first == of_b.first; });
  });
}

/// Checks that drives in different files share no scans. @param wanted the ids of the drives that count.
void checkNoSharedScans(const Records& records, const DriveSet& wanted) {
  std::map<std::string, std::vector<std::pair<ScanRange, const Records::value_type*>>> sequences;
  for (const Records::value_type& record : records) {
    const auto scans = scansOf(record.first);
    if (scans && wanted.count(record.first) > 0) sequences[scans->sequence].emplace_back(*scans, &record);
  }
  for (auto& [sequence, drives] : sequences) {
    std::sort(drives.begin(), drives.end(),
              [](const auto& a, const auto& b) { return a.first.first < b.first.first; });
    for (auto a = drives.begin(); a != drives.end(); ++a) {
      for (auto b = a + 1; b != drives.end() && b->first.first <= a->first.last; ++b) {
        const auto& [id, found] = *a->second;
        const auto& [other_id, other_found] = *b->second;
        const auto shared = sharedScans(found.front().second, other_found.front().second);
        if (!shared || areInOneFile(found, other_found)) continue;
        throw MapFileError("by their ids, drive '" + id + "' in " + found.front().first->file.path() +
                           " and drive '" + other_id + "' in " + other_found.front().first->file.path() +
                           " share " + textOf(*shared) +
                           ", which would count twice; leave one of the drives out (--without), or, if they "
                           "are different scans, go on with --allow-overlap");
      }
    }
  }
}

/// Names and bounds of a drive may differ between files. The choice depends on their values only, so that the
/// order of the files does not matter.
DriveRecord chosenRecord(const std::vector<std::pair<const PlacedFile*, DriveRecord>>& found) {
  const auto key = [](const DriveRecord& r) {
    const Eigen::Vector3d &low = r.bounds.min(), &high = r.bounds.max();
    return std::tuple(r.name, low.x(), low.y(), low.z(), high.x(), high.y(), high.z());
  };
  return std::min_element(found.begin(), found.end(),
                          [&](const auto& a, const auto& b) { return key(a.second) < key(b.second); })
      ->second;
}

/// The info of the result: that of the file with the latest scan. Among several, the choice depends on values
/// only.
MapInfo newestInfo(const Files& files) {
  const auto key = [](const std::shared_ptr<PlacedFile>& file) {
    std::uint64_t latest = 0;
    for (const DriveRecord& drive : file->file.drives()) latest = std::max(latest, drive.last_stamp);
    const MapInfo& info = file->file.info();
    std::vector<std::tuple<ClassId, std::string, std::array<std::uint8_t, 3>, std::vector<std::uint32_t>,
                           bool, bool, bool, bool, bool, bool, std::optional<double>>>
        classes;
    for (const SemanticClass& c : info.classes->classes()) {
      classes.emplace_back(c.id, c.name, c.color, c.raw, c.any_raw, c.unlabelled, c.dynamic, c.living,
                           c.ground, c.ignored, c.free_gain);
    }
    return std::tuple(latest, info.parameters, info.classes->name(), classes, info.classes->labelMask());
  };
  return (*std::max_element(files.begin(), files.end(),
                            [&](const auto& a, const auto& b) { return key(a) < key(b); }))
      ->file.info();
}

/// Summands with the same drives. They must hold the same evidence, and one of them counts.
using Group = std::vector<Summand>;

std::vector<Group> groupsOf(const Files& files) {
  std::map<DriveSet, Group> groups;
  for (const auto& file : files) {
    for (Summand& summand : summandsOf(file)) groups[summand.drives()].push_back(std::move(summand));
  }
  std::vector<Group> sorted;
  for (auto& [drives, group] : groups) sorted.push_back(std::move(group));
  return sorted;
}

std::string quoted(const DriveSet& drives) {
  std::string text;
  for (const std::string& id : drives) text += (text.empty() ? "'" : ", '") + id + "'";
  return text;
}

DriveSet common(const DriveSet& a, const DriveSet& b) {
  DriveSet both;
  std::set_intersection(a.begin(), a.end(), b.begin(), b.end(), std::inserter(both, both.end()));
  return both;
}

/// The error that says why no choice of groups counts each drive once.
MapFileError cannotCover(const DriveSet& wanted, const DriveSet& without, const std::vector<Group>& groups) {
  for (const std::string& id : wanted) {
    const Group* bound = nullptr;
    for (const Group& group : groups) {
      if (group.front().drives().count(id) == 0) continue;
      bound = &group;
      if (disjoint(group.front().drives(), without)) break;
    }
    if (disjoint(bound->front().drives(), without)) continue;
    return MapFileError("drive " + quoted(common(bound->front().drives(), without)) +
                        " cannot be left out: " + bound->front().path() +
                        " holds its evidence only in a sum with that of '" + id +
                        "'; leave that drive out, too, or make the file with --keep-drives");
  }
  std::vector<const Group*> by_size;
  for (const Group& group : groups) {
    if (disjoint(group.front().drives(), without)) by_size.push_back(&group);
  }
  std::stable_sort(by_size.begin(), by_size.end(), [](const Group* a, const Group* b) {
    return a->front().drives().size() < b->front().drives().size();
  });
  for (const Group* a : by_size) {
    for (const Group* b : by_size) {
      const DriveSet &of_a = a->front().drives(), &of_b = b->front().drives(), both = common(of_a, of_b);
      if (both.empty() || both == of_a || both == of_b) continue;
      return MapFileError(
          "drive " + quoted(both) + " is in " + a->front().path() + " in a sum with others, and in " +
          b->front().path() +
          ", too, so that it would count twice; make one of them without it, or make both with "
          "--keep-drives");
    }
  }
  throw std::logic_error("sets of drives without a cover, which do not overlap");
}

/// The groups whose sum is the map.
std::vector<Group> choose(std::vector<Group> groups, const DriveSet& wanted, const DriveSet& without,
                          bool keep_drives) {
  std::vector<DriveSet> sets;
  for (const Group& group : groups) sets.push_back(group.front().drives());
  auto positions = exactCover(wanted, sets, keep_drives);
  if (!positions) throw cannotCover(wanted, without, groups);
  std::sort(positions->begin(), positions->end());
  std::vector<Group> chosen;
  for (const std::size_t position : *positions) chosen.push_back(std::move(groups[position]));
  return chosen;
}

/// Adds a map to another one, and counts the sums that saturate.
std::uint64_t addCounting(SemanticMap& sum, const SemanticMap& other) {
  std::uint64_t saturated = 0;
  for (const auto& [index, block] : other.entries()) {
    Block& to = sum.getOrAllocate(index);
    for (std::size_t p = 0; p < block->classes().size(); ++p) {
      saturated += to.add(block->classes()[p], block->plane(p));
    }
    to.setOcclusion(to.occlusion() | block->occlusion());
    to.looks().add(block->looks());
    if (to.empty()) sum.erase(index);  // negative evidence may have cancelled all of it
  }
  return saturated;
}

/// Reads a tile of the first summand of a group, and compares it with the others.
SemanticMap readTile(const Group& group, const GridIndex& tile) {
  SemanticMap evidence = group.front().read(tile);
  for (std::size_t i = 1; i < group.size(); ++i) {
    const SemanticMap same = group[i].read(tile);
    if (!sameEvidence(evidence, same)) {
      throw notTheSame(*group.front().drives().begin(), group.front().path(), group[i].path(),
                       "its evidence differs, as after clearing or with other settings");
    }
    for (const auto& [index, block] : same.entries()) {  // a file of an older version has none
      if (!block->looks().empty()) evidence.getOrAllocate(index).looks().add(block->looks());
    }
  }
  return evidence;
}

/// The tiles of each group, and those of all groups together; sorted.
struct TileLists {
  std::vector<std::vector<GridIndex>> of_group;
  std::vector<GridIndex> all;
};

void sortUnique(std::vector<GridIndex>& tiles) {
  std::sort(tiles.begin(), tiles.end());
  tiles.erase(std::unique(tiles.begin(), tiles.end()), tiles.end());
}

TileLists listTiles(const std::vector<Group>& groups, const std::optional<TileColumns>& columns) {
  TileLists lists;
  for (const Group& group : groups) {
    std::vector<GridIndex>& tiles = lists.of_group.emplace_back();
    for (const Summand& summand : group) {
      const std::vector<GridIndex> more = summand.tiles();
      std::copy_if(more.begin(), more.end(), std::back_inserter(tiles),
                   [&](const GridIndex& tile) { return !columns || columns->contain(tile); });
    }
    sortUnique(tiles);
    lists.all.insert(lists.all.end(), tiles.begin(), tiles.end());
  }
  sortUnique(lists.all);
  return lists;
}

/// The files whose journals may have scans of the chosen groups.
std::vector<JournalSource> journalSources(const Files& files, const std::vector<Group>& groups,
                                          const MergeOptions& options) {
  std::vector<JournalSource> sources;
  for (const auto& file : files) {
    JournalSource source{&file->file, {}, ""};
    for (const Group& group : groups) {
      for (const Summand& summand : group) {
        if (summand.isOf(*file)) source.drives.insert(summand.drives().begin(), summand.drives().end());
      }
    }
    if (!file->transform.identity()) {
      source.obstacle = "it is moved by --transform";
    } else if (options.keep_drives) {
      source.obstacle = "--keep-drives stores drives separately";
    } else if (options.columns) {
      source.obstacle = "--tiles leaves out some of their evidence";
    }
    sources.push_back(std::move(source));
  }
  return sources;
}

}  // namespace

MergeReport mergeMaps(const MergeOptions& options) {
  const Files files = openAll(options);
  for (const auto& file : files) {
    checkSameGrid(files.front()->file.path(), files.front()->file.info(), file->file.path(),
                  file->file.info());
  }
  MapInfo info = newestInfo(files);
  info.frame = commonFrame(files);
  const Records records = recordsOf(files);
  const DriveSet without(options.without.begin(), options.without.end());
  DriveSet all, wanted;
  for (const auto& [id, found] : records) all.insert(id);
  for (const std::string& id : without) {
    if (all.count(id) > 0) continue;
    throw std::invalid_argument("drive '" + id + "' is in none of the maps; they hold " +
                                (all.empty() ? "none" : quoted(all)));
  }
  std::set_difference(all.begin(), all.end(), without.begin(), without.end(),
                      std::inserter(wanted, wanted.end()));
  checkSameDrives(records);
  if (!options.allow_overlap) checkNoSharedScans(records, wanted);
  const std::vector<Group> groups = choose(groupsOf(files), wanted, without, options.keep_drives);

  MergeReport report;
  for (const auto& file : files) {
    if (!file->transform.exact()) report.resampled.push_back(file->file.path());
  }
  for (std::size_t g = 0; g < groups.size(); ++g) {
    for (const std::string& id : groups[g].front().drives()) {
      DriveRecord drive = chosenRecord(records.at(id));
      drive.part = options.keep_drives ? static_cast<int>(g) + 1 : 0;
      report.drives.push_back(drive);
      if (records.at(id).size() > 1) report.repeated.push_back(id);
    }
  }
  std::sort(report.drives.begin(), report.drives.end(),
            [](const DriveRecord& a, const DriveRecord& b) { return a.id < b.id; });
  std::sort(report.repeated.begin(), report.repeated.end());

  const auto replaced = std::find_if(files.begin(), files.end(), [&](const auto& file) {
    return isSameFile(file->file.path(), options.output);
  });
  NewMapFile output(options.output, info, replaced == files.end() ? nullptr : &(*replaced)->file);
  for (const DriveRecord& drive : report.drives) output.content().putDrive(drive);
  const TileLists lists = listTiles(groups, options.columns);
  std::size_t done = 0;
  for (const GridIndex& tile : lists.all) {
    SemanticMap sum = info.emptyMap();
    for (std::size_t g = 0; g < groups.size(); ++g) {
      const std::vector<GridIndex>& tiles = lists.of_group[g];
      if (!std::binary_search(tiles.begin(), tiles.end(), tile)) continue;
      const SemanticMap evidence = readTile(groups[g], tile);
      if (options.keep_drives) output.content().writeTile(evidence, {tile, static_cast<int>(g) + 1});
      report.saturated += addCounting(sum, evidence);
    }
    output.content().writeTile(sum, {tile});
    report.tiles += sum.size() > 0;
    report.blocks += sum.size();
    if (options.progress) options.progress(++done, lists.all.size());
  }
  report.without_journal = mergeJournals(journalSources(files, groups, options), output.content());
  output.commit();
  return report;
}

}  // namespace bki_mapping
