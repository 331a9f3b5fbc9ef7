#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "arrays.h"
#include "bindings.h"
#include "bki_mapping/query/queries.h"

namespace bki_mapping::python {
namespace {

/// Reads without the GIL.
void read(const FixedMap& map, const Points& points, const PointValues& values) {
  const py::gil_scoped_release release;
  points.visit([&](const auto& span) { readPoints(map.states, span, values); });
}

py::array_t<std::uint8_t> statesAt(const FixedMap& map, py::handle object) {
  const Points points(object, "points");
  py::array_t<std::uint8_t> states(static_cast<py::ssize_t>(points.size()));
  PointValues values;
  values.states = reinterpret_cast<VoxelState*>(states.mutable_data());
  read(map, points, values);
  return states;
}

/// @tparam kField the member of PointValues that is asked for.
template <typename Value, Value* PointValues::*kField>
py::array_t<Value> valuesAt(const FixedMap& map, py::handle object) {
  const Points points(object, "points");
  PointValues values;
  py::array_t<Value> result(static_cast<py::ssize_t>(points.size()));
  values.*kField = result.mutable_data();
  read(map, points, values);
  return result;
}

/// What is asked of points, as fields of a structured array.
class PointRecord {
 public:
  /// Names of the fields; the first ones are those of PointValues.
  enum Name { kState, kLabel, kProbability, kVariance, kOccupancy, kClassProbability, kEvidence, kEntropy };
  static constexpr std::array<const char*, 8> kNames = {
      "state", "label", "probability", "variance", "occupancy", "class_probability", "evidence", "entropy"};

  /// @param wanted words, in one string joined by commas, or in a list.
  explicit PointRecord(py::handle wanted) {
    offsets_.fill(kAbsent);
    const std::string words = wordsOf(wanted, "fields");
    for (std::size_t begin = 0; begin <= words.size();) {
      const std::size_t end = std::min(words.find(',', begin), words.size());
      add(words.substr(begin, end - begin));
      begin = end + 1;
    }
    if (bytes_ % alignment_ != 0) bytes_ += alignment_ - bytes_ % alignment_;
  }

  py::dtype dtype() const { return structType(fields_, bytes_); }
  std::size_t bytes() const { return bytes_; }
  bool has(Name name) const { return offsets_[name] != kAbsent; }
  /// @param records of which `values` are the field `name`.
  template <typename T>
  void write(Name name, const T* values, std::size_t count, char* records) const {
    if (!has(name)) return;
    char* to = records + offsets_[name];
    for (std::size_t n = 0; n < count; ++n, to += bytes_) std::memcpy(to, &values[n], sizeof(T));
  }

 private:
  static constexpr std::size_t kAbsent = std::numeric_limits<std::size_t>::max();

  void add(const std::string& word) {
    const auto known = std::find(kNames.begin(), kNames.end(), word);
    if (known == kNames.end()) {
      std::string names;
      for (const char* const name : kNames) names += (names.empty() ? "" : ", ") + std::string(name);
      throw std::invalid_argument("field '" + word + "' is unknown; known fields: " + names);
    }
    const auto name = static_cast<std::size_t>(known - kNames.begin());
    if (offsets_[name] != kAbsent) {
      throw std::invalid_argument("field '" + word + "' is given twice; keep one");
    }
    const std::size_t size = name <= kLabel ? 1 : sizeof(float);
    bytes_ = (bytes_ + size - 1) / size * size;
    alignment_ = std::max(alignment_, size);
    offsets_[name] = bytes_;
    fields_.push_back({*known, name <= kLabel ? "u1" : "f4", bytes_});
    bytes_ += size;
  }

  std::vector<Field> fields_;
  std::array<std::size_t, kNames.size()> offsets_;
  std::size_t bytes_ = 0, alignment_ = 1;
};

/// Reads points part by part into arrays that stay in the cache, and from there into the records.
class RecordReader {
 public:
  static constexpr std::size_t kPart = 2048;  ///< points

  RecordReader(const FixedMap& map, const PointRecord& record)
      : map_(map), record_(record), reader_(map.states) {
    using R = PointRecord;
    const auto wanted = [&](R::Name name, auto& values) {
      return record.has(name) ? values.data() : nullptr;
    };
    values_.states = wanted(R::kState, states_);
    values_.labels = wanted(R::kLabel, labels_);
    values_.probability = wanted(R::kProbability, probability_);
    values_.variance = wanted(R::kVariance, variance_);
    values_.occupancy = wanted(R::kOccupancy, occupancy_);
    values_.class_probability = wanted(R::kClassProbability, class_probability_);
  }

  template <typename Point>
  void read(Span<const Point> points, char* records) {
    using R = PointRecord;
    readPoints(map_.states, points, values_);
    const std::size_t count = points.size();
    record_.write(R::kState, states_.data(), count, records);
    record_.write(R::kLabel, labels_.data(), count, records);
    record_.write(R::kProbability, probability_.data(), count, records);
    record_.write(R::kVariance, variance_.data(), count, records);
    record_.write(R::kOccupancy, occupancy_.data(), count, records);
    record_.write(R::kClassProbability, class_probability_.data(), count, records);
    if (!record_.has(R::kEvidence) && !record_.has(R::kEntropy)) return;
    for (std::size_t n = 0; n < count; ++n, records += record_.bytes()) {
      const VoxelView view = viewAt(points[n].template cast<double>());
      record_.write(R::kEvidence, &view.evidence, 1, records);
      record_.write(R::kEntropy, &view.entropy, 1, records);
    }
  }

 private:
  template <typename T>
  using Part = std::array<T, kPart>;

  VoxelView viewAt(const Eigen::Vector3d& point) {
    static const Block kNoEvidence;
    const GridGeometry& grid = map_.states.geometry();
    const Block* block = nullptr;
    BlockIndex index;
    int offset = 0;
    if (grid.contains(point)) {
      const VoxelIndex voxel = grid.voxelAt(point);
      index = GridGeometry::blockOf(voxel);
      const BlockStates* const found = reader_.find(index);
      if (found) block = found->block;
      offset = GridGeometry::offsetInBlock(voxel);
    }
    const auto view =
        record_.has(PointRecord::kEntropy) ? &viewVoxel : static_cast<ViewInBlock>(&viewWithoutEntropy);
    return view(map_.states.map(), map_.states.rules(), index, block ? *block : kNoEvidence, offset);
  }
  using ViewInBlock = VoxelView (*)(const SemanticMap&, const StateRules&, const BlockIndex&, const Block&,
                                    int);

  const FixedMap& map_;
  const PointRecord& record_;
  BlockReader reader_;
  PointValues values_;
  Part<VoxelState> states_;
  Part<ClassId> labels_;
  Part<float> probability_, variance_, occupancy_, class_probability_;
};

py::array query(const FixedMap& map, py::handle object, py::handle fields) {
  const Points points(object, "points");
  const PointRecord record(fields);
  py::array result(record.dtype(), std::vector<py::ssize_t>{static_cast<py::ssize_t>(points.size())});
  auto* const records = static_cast<char*>(result.mutable_data());
  const py::gil_scoped_release release;
  points.visit([&](const auto& span) {
    try {
      inParts(map.states, span.size(), RecordReader::kPart, [&](std::size_t begin, std::size_t end) {
        RecordReader(map, record)
            .read(Span(span.data() + begin, end - begin), records + begin * record.bytes());
      });
    } catch (const std::invalid_argument&) {
      readPoints(map.states, span, {});  // throws as well, and numbers the point among all of them
      throw;
    }
  });
  return result;
}

py::array_t<float> posterior(const FixedMap& map, py::handle object) {
  const Points points(object, "points");
  const std::vector<SemanticClass>& classes = map.stored.info.classes->classes();
  const std::size_t columns = classes.size() + 1;
  py::array_t<float> result({static_cast<py::ssize_t>(points.size()), static_cast<py::ssize_t>(columns)});
  float* const rows = result.mutable_data();
  read(map, points, {});  // refuses points that are not finite
  const py::gil_scoped_release release;
  std::vector<std::size_t> column_of(kMaxClasses + 2, 0);
  for (std::size_t c = 0; c < classes.size(); ++c) column_of[classes[c].id] = c;
  column_of[kFreeClass] = classes.size();
  const SemanticMap& semantic = map.stored.map;
  const GridGeometry& grid = semantic.geometry();
  constexpr std::size_t kPart = 1024;
  inParts(map.states, points.size(), kPart, [&](std::size_t begin, std::size_t end) {
    BlockReader reader(map.states);
    std::vector<double> alpha(columns);
    for (std::size_t i = begin; i < end; ++i) {
      std::fill(alpha.begin(), alpha.end(), semantic.prior());
      double sum = semantic.priorSum();
      const Eigen::Vector3d point = points.at(i);
      const bool within = grid.contains(point);
      const VoxelIndex voxel = within ? grid.voxelAt(point) : VoxelIndex();
      const BlockStates* const found = within ? reader.find(GridGeometry::blockOf(voxel)) : nullptr;
      if (found) {
        const Block& block = *found->block;
        for (std::size_t p = 0; p < block.classes().size(); ++p) {
          const auto evidence =
              static_cast<double>(evidenceOf(block.plane(p)[GridGeometry::offsetInBlock(voxel)]));
          alpha[column_of[block.classes()[p]]] += evidence;
          sum += evidence;
        }
      }
      for (std::size_t c = 0; c < columns; ++c) rows[i * columns + c] = static_cast<float>(alpha[c] / sum);
    }
  });
  return result;
}

}  // namespace

void addPoints(MapClass& map) {
  map.def("states", &statesAt, py::arg("points"),
          "The state of each voxel: UNKNOWN, FREE, OCCUPIED or OCCLUDED; (N,), uint8.")
      .def("labels", &valuesAt<ClassId, &PointValues::labels>, py::arg("points"),
           "The class id of each occupied voxel; FREE_CLASS elsewhere; (N,), uint8.")
      .def("probabilities", &valuesAt<float, &PointValues::probability>, py::arg("points"),
           "The expected probability of the voxel's class if it is occupied, otherwise of free; (N,), "
           "float32.")
      .def("variances", &valuesAt<float, &PointValues::variance>, py::arg("points"),
           "The variance of `probabilities` under the posterior; (N,), float32.")
      .def("occupancies", &valuesAt<float, &PointValues::occupancy>, py::arg("points"),
           "The probability that something, of any class, is there: 0.029 to 0.91; (N,), float32.")
      .def("class_probabilities", &valuesAt<float, &PointValues::class_probability>, py::arg("points"),
           "The probability of the most likely class, given that something is there; (N,), float32.")
      .def("posterior", &posterior, py::arg("points"),
           "The expected probability of every class, in the order of the class table, and, last, of free; "
           "(N, number of classes + 1), float32. Rows sum to 1.")
      .def("query", &query, py::arg("points"),
           py::arg("fields") =
               py::make_tuple("state", "label", "probability", "variance", "occupancy", "class_probability"),
           "Several values of each voxel, read in one pass: (N,), structured.\n\nfields: those of the "
           "result, a list or joined by commas: state, label, probability, variance, occupancy, "
           "class_probability (as from the functions above), evidence (the sum over all classes and free), "
           "entropy (of the expected distribution over all classes and free [nat]; slow to compute).\n\n"
           "Raises ValueError for an unknown field.");
}

}  // namespace bki_mapping::python
