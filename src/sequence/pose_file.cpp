#include "sequence/pose_file.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "bki_mapping/core/named_parameter.h"

namespace bki_mapping {
namespace {

constexpr std::size_t kRows3 = 12, kRows4 = 16, kStamped = 8, kStampedPosition = 4;
/// Tolerance of determinants and of lengths of quaternions, for poses that were written with few digits.
constexpr double kRotationTolerance = 0.1;

/// A file may have this many blank lines in a row before a pose: each takes memory as a pose does.
constexpr std::size_t kMostBlank = 100000;

bool isFormat(std::size_t numbers) {
  return numbers == kRows3 || numbers == kRows4 || numbers == kStamped || numbers == kStampedPosition;
}

/// @throws std::runtime_error without the name of the file.
std::vector<double> numbersOf(const std::string& line) {
  std::istringstream words(line);
  std::vector<double> numbers;
  for (std::string word; words >> word;) {
    char* end = nullptr;
    numbers.push_back(std::strtod(word.c_str(), &end));
    if (*end != '\0' || !std::isfinite(numbers.back())) {
      throw std::runtime_error(": '" + word + "' is not a finite number");
    }
  }
  return numbers;
}

/// @param numbers qx qy qz qw.
Eigen::Matrix3d rotationOf(const double* numbers) {
  const Eigen::Quaterniond rotation(numbers[3], numbers[0], numbers[1], numbers[2]);
  if (!(std::abs(rotation.norm() - 1.0) < kRotationTolerance)) {
    throw std::runtime_error(" is not a rigid transform: its quaternion has length " +
                             numberText(rotation.norm()) + " instead of 1");
  }
  return rotation.normalized().toRotationMatrix();
}

/// @param where the file and the line. @param numbers of the line: kStamped or kStampedPosition.
void readStamped(const std::vector<double>& numbers, const std::string& where, PoseLine& line) {
  line.seconds = numbers[0];
  line.pose.translation() = Eigen::Vector3d(numbers[1], numbers[2], numbers[3]);
  try {
    if (numbers.size() != kStamped)
      throw std::runtime_error(" has no rotation; write seconds x y z qx qy qz qw");
    line.pose.linear() = rotationOf(&numbers[4]);
  } catch (const std::runtime_error& fault) {
    line.rotation_fault = where + fault.what();
  }
}

bool isStamped(std::size_t columns) {
  return columns == kStamped || columns == kStampedPosition;
}

/// @param columns of the file's format; 0: not known yet. @throws std::runtime_error without file and line.
void checkCount(std::size_t numbers, std::size_t columns) {
  const std::string has = " has " + std::to_string(numbers) + " numbers, but needs ";
  if (columns == 0) throw std::runtime_error(has + "12 (3x4), 16 (4x4) or 8 (seconds x y z qx qy qz qw)");
  if (numbers == columns || (isStamped(numbers) && isStamped(columns))) return;
  throw std::runtime_error(has + std::to_string(columns) + ", as the lines before it");
}

/// @param[in,out] columns of the file's format; 0: not known yet.
PoseLine readLine(const std::string& text, const std::string& path, std::size_t number,
                  std::size_t& columns) {
  PoseLine line;
  line.number = number;
  line.blank = text.empty();
  const std::string where = path + " line " + std::to_string(number);
  try {
    const std::vector<double> numbers = numbersOf(text);
    if (columns == 0 && isFormat(numbers.size())) columns = numbers.size();
    checkCount(numbers.size(), columns);
    if (isStamped(columns)) {
      readStamped(numbers, where, line);
    } else {
      line.pose = rigidTransform(numbers, "");
    }
  } catch (const std::runtime_error& fault) {
    line.fault = where + fault.what();
  }
  return line;
}

}  // namespace

Eigen::Isometry3d rigidTransform(const std::vector<double>& numbers, const std::string& what) {
  if (numbers.size() != kRows3 && numbers.size() != kRows4) {
    throw std::runtime_error(what + " has " + std::to_string(numbers.size()) +
                             " numbers, but needs 12 (3x4)");
  }
  const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> matrix(numbers.data());
  const Eigen::Matrix3d rotation = matrix.leftCols<3>();
  if (!(std::abs(rotation.determinant() - 1.0) < kRotationTolerance)) {
    throw std::runtime_error(what + " is not a rigid transform: its rotation has determinant " +
                             std::to_string(rotation.determinant()) + " instead of 1");
  }
  if (numbers.size() == kRows4 && Eigen::Vector4d(numbers.data() + kRows3) != Eigen::Vector4d::UnitW()) {
    throw std::runtime_error(what + " is not a rigid transform: the last row of its matrix is not 0 0 0 1");
  }
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = Eigen::Quaterniond(rotation).normalized().toRotationMatrix();
  T.translation() = matrix.col(3);
  return T;
}

std::string rowOf(const Eigen::Isometry3d& T) {
  std::ostringstream row;
  row.precision(17);
  for (int i = 0; i < 12; ++i) row << (i ? " " : "") << T.matrix()(i / 4, i % 4);
  return row.str();
}

Eigen::Isometry3d readCalibration(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file || std::filesystem::is_directory(path)) {
    throw std::runtime_error(
        path +
        " cannot be read; poses of the camera need calib.txt with a line 'Tr:' (sensor to "
        "camera); if they are of the lidar, say so with --poses-in lidar");
  }
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string key;
    words >> key;
    if (key != "Tr:" && key != "Tr") continue;
    std::vector<double> numbers;
    for (double number = 0.0; words >> number;) numbers.push_back(number);
    return rigidTransform(numbers, path + ", Tr:");
  }
  throw std::runtime_error(path + " has no line 'Tr:'; add the transform from sensor to camera");
}

PoseFile readPoseFile(const std::string& path, const std::string& remedy) {
  std::ifstream file(path, std::ios::binary);
  if (!file || std::filesystem::is_directory(path)) {
    throw std::runtime_error(path + " cannot be read; " + remedy);
  }
  PoseFile poses;
  std::size_t number = 0, columns = 0;
  std::vector<std::size_t> blanks;  // numbers of lines, which count only if a pose follows
  for (std::string text; std::getline(file, text);) {
    ++number;
    const std::size_t begin = text.find_first_not_of(" \t\r");
    if (begin == std::string::npos) {
      if (blanks.size() <= kMostBlank) blanks.push_back(number);
      continue;
    }
    if (text[begin] == '#') continue;
    if (blanks.size() > kMostBlank) {
      throw std::runtime_error(path + " line " + std::to_string(number) + " follows more than " +
                               std::to_string(kMostBlank) +
                               " blank lines, each of which stands for a scan; remove those");
    }
    for (const std::size_t blank : blanks) poses.lines.push_back(readLine("", path, blank, columns));
    blanks.clear();
    poses.lines.push_back(readLine(text, path, number, columns));
  }
  poses.has_stamps = isStamped(columns);
  return poses;
}

}  // namespace bki_mapping
