// Any bytes as a map file: read, and changed if they can be read. No crash, no other fault than a
// MapFileError in one sentence, no more memory than goes with the size. Run by libFuzzer, or by
// fuzz_corpus.cpp.
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "bki_mapping/store/map_file.h"
#include "store/counted_memory.h"
#include "store/file_content.h"
#include "temporary_folder.h"

namespace bki_mapping {
namespace {

constexpr std::size_t kLargest = 1 << 20;

void require(bool condition, const std::string& what) {
  if (condition) return;
  std::fprintf(stderr, "%s\n", what.c_str());
  std::abort();
}

/// @return whether there is no MapFileError.
template <typename Program>
bool works(const std::string& path, Program&& program) {
  try {
    program();
    return true;
  } catch (const MapFileError& error) {
    const std::string sentence = error.what();
    require(sentence.rfind(path + " ", 0) == 0, "the file is not named: " + sentence);
    require(sentence.find("; ") != std::string::npos, "there is no remedy: " + sentence);
    require(sentence.find_first_of("\n\r\x1b") == std::string::npos, "no sentence: " + sentence);
    require(sentence.size() < 1000, "too long: " + sentence);
    return false;
  }
}

void change(const std::string& path) {
  MapFile file(path, MapFile::Access::kUpdate);
  SemanticMap map = file.info().emptyMap();
  const ClassId id = file.info().classes->classes()[0].id;
  map.getOrAllocate({{0, 0, 0}}).add(id, std::vector<EvidenceUnits>(kBlockVoxels, 5).data());
  MapFile::Change change = file.change();
  const std::vector<TileEntry> tiles = file.tiles();
  if (!tiles.empty()) change.eraseTile({tiles[tiles.size() / 2].index});
  change.writeTile(map, {{0, 0, 0}});
  DriveRecord drive;
  drive.id = "another";
  change.putDrive(drive);
  for (const DriveRecord& each : file.drives()) {
    if (each.id != drive.id) change.eraseDrive(each.id);
  }
  change.commit();
}

}  // namespace
}  // namespace bki_mapping

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  using namespace bki_mapping;
  if (size > kLargest) return 0;
  static const TemporaryFolder folder(memoryFolder());
  const std::string path = folder / "map.bkm";
  writeFile(path, {reinterpret_cast<const char*>(data), size});
  bool can_be_read = false;
  {
    const PeakMemory memory;
    can_be_read = works(path, [&] { contentOf(path); });
    require(memory.bytes() < memoryLimit(size), std::to_string(memory.bytes()) + " bytes of memory");
  }
  require(folder.fileCount() == 1, "reading made files");
  if (can_be_read && works(path, [&] { change(path); })) {
    // What was damaged before may come to light only now.
    works(path, [&] { contentOf(path); });
  }
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) std::filesystem::remove(entry);
  return 0;
}
