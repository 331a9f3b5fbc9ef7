// Writes the map of example_map.h to a file: write_example_map FILE. It made the newest of
// test/store/data/version_N.bkm, and makes the file that goes there beside it when the format has a new
// version.
#include <exception>
#include <iostream>

#include "store/example_map.h"

int main(int argc, char** argv) try {
  using namespace bki_mapping;
  if (argc != 2) throw std::invalid_argument("usage: write_example_map FILE");
  const SemanticMap part = exampleMap(1);
  SemanticMap sum = exampleMap(0);
  sum.add(part);
  NewMapFile file(argv[1], exampleInfo());
  for (const DriveRecord& drive : exampleDrives()) file.content().putDrive(drive);
  for (const GridIndex& tile : tilesOf(sum)) file.content().writeTile(sum, {tile});
  for (const GridIndex& tile : tilesOf(part)) file.content().writeTile(part, {tile, 1});
  addExampleJournal(file.content());
  file.commit();
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
