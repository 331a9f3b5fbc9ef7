// Plans how a robot drives through a mapped street. Usage: plan_path FILE.bkm CLASSES X Y YAW X Y YAW, start
// and goal in the map frame [m, rad]. Writes poses on the ground, 0.1 m apart, and the cost of the ground
// there: x, y, z, yaw, cost.
#include <bki_mapping/settings/yaml.h>
#include <bki_mapping/store/mapper_file.h>

#include <iostream>
#include <stdexcept>
#include <string>
#include <vector>

#include "planner.h"

using namespace planner;

int main(int argc, char** argv) try {
  if (argc != 9) throw std::invalid_argument("give a map file, a class table, and X Y YAW of start and goal");
  Pose start, goal;
  for (int i = 0; i < 3; ++i) {
    start[i] = std::stod(argv[3 + i]);
    goal[i] = std::stod(argv[6 + i]);
  }
  const RuledMap stored = loadRuledMap(argv[1]);
  const ClassTable classes = loadClassTable(argv[2]);  // with costs, which map files do not have
  for (const SemanticClass& each : stored.info.classes->classes()) {
    const SemanticClass* const own = classes.find(each.id);
    if (own && own->name == each.name) continue;
    throw std::invalid_argument("the class table lacks class '" + each.name +
                                "' of the map; give the map's own table");
  }
  Eigen::AlignedBox3d area;
  for (const DriveRecord& drive : stored.drives) area.extend(drive.bounds);
  const Street street(stored.map, stored.rules, classes, area);
  if (!street.isDrivable(start)) throw std::invalid_argument("the robot cannot stand at the start");
  if (!street.isDrivable(goal)) throw std::invalid_argument("the robot cannot stand at the goal");
  const std::vector<Pose> path = plan(street, start, goal);
  std::cout << "x,y,z,yaw,cost\n";
  for (const Pose& at : path) {
    const ColumnView column = street.columnAt(at);
    std::cout << at.x() << "," << at.y() << "," << column.ground << "," << at.z() << "," << int{column.cost}
              << "\n";
  }
} catch (const std::exception& error) {
  std::cerr << "plan_path: " << error.what() << "\n";
  return 1;
}
