#include "settings/yaml_file.h"

#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <utility>
#include <vector>

namespace bki_mapping {
namespace {

constexpr std::size_t kMaxBytes = 1000000, kMaxLevels = 32, kMaxNodes = 100000;

[[noreturn]] void refuse(const std::string& why) {
  throw YAML::Exception(YAML::Mark::null_mark(), why);
}

[[noreturn]] void refuse(const YAML::Mark& mark, const std::string& why) {
  refuse("line " + std::to_string(mark.line + 1) + ": " + why);
}

/// Checks the limits while the parser reads, before it descends further.
class Bounds : public YAML::EventHandler {
 public:
  void OnDocumentStart(const YAML::Mark& mark) override {
    if (++documents_ > 1) refuse(mark, "another document begins; a file must hold one document");
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    addChild(mark, nullptr);
    addNodes(mark, 1);
    if (anchor != YAML::NullAnchor) extents_[anchor] = {1, 0};
  }
  void OnScalar(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                const std::string& value) override {
    addChild(mark, &value);
    addNodes(mark, 1);
    if (anchor != YAML::NullAnchor) extents_[anchor] = {1, 0};
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    addChild(mark, nullptr);
    const auto found = extents_.find(anchor);
    if (found == extents_.end()) refuse(mark, "an alias refers to the node that it is in");
    addNodes(mark, found->second.nodes);
    addLevels(mark, found->second.levels);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    begin(mark, anchor, false);
  }
  void OnSequenceEnd() override { end(); }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    begin(mark, anchor, true);
  }
  void OnMapEnd() override { end(); }

 private:
  /// Size of a node with all aliases expanded.
  struct Extent {
    std::size_t nodes = 0, levels = 0;
  };
  /// A list or map whose end has not been read yet.
  struct Open {
    YAML::anchor_t anchor;
    bool is_map;
    std::size_t nodes_before;
    std::size_t levels = 1;
    bool value_is_next = false;
    std::set<std::string> keys;
  };

  /// @param text of a scalar; nullptr for other nodes.
  void addChild(const YAML::Mark& mark, const std::string* text) {
    if (open_.empty() || !open_.back().is_map) return;
    Open& map = open_.back();
    map.value_is_next = !map.value_is_next;
    if (!map.value_is_next) return;
    if (text == nullptr) refuse(mark, "a key must be plain text");
    if (!map.keys.insert(*text).second) refuse(mark, "'" + *text + "' is given twice; keep one");
  }

  void addNodes(const YAML::Mark& mark, std::size_t count) {
    nodes_ += count;
    if (nodes_ > kMaxNodes) {
      refuse(mark,
             "it has more than " + std::to_string(kMaxNodes) + " nodes, aliases followed; the limit is");
    }
  }

  /// Counts levels below the innermost open list or map.
  void addLevels(const YAML::Mark& mark, std::size_t levels) {
    if (open_.size() + levels > kMaxLevels) {
      refuse(mark, "lists and maps are nested more than " + std::to_string(kMaxLevels) + " levels deep");
    }
    // The outer ones are updated in end(), which avoids a walk over all of them for every node.
    if (!open_.empty()) open_.back().levels = std::max(open_.back().levels, levels + 1);
  }

  void begin(const YAML::Mark& mark, YAML::anchor_t anchor, bool is_map) {
    addChild(mark, nullptr);
    addLevels(mark, 1);
    open_.push_back({anchor, is_map, nodes_, 1, false, {}});
    addNodes(mark, 1);
  }

  void end() {
    const Open ended = std::move(open_.back());
    open_.pop_back();
    if (!open_.empty()) open_.back().levels = std::max(open_.back().levels, ended.levels + 1);
    if (ended.anchor != YAML::NullAnchor) {
      extents_[ended.anchor] = {nodes_ - ended.nodes_before, ended.levels};
    }
  }

  std::size_t documents_ = 0, nodes_ = 0;
  std::vector<Open> open_;
  std::map<YAML::anchor_t, Extent> extents_;  ///< of complete nodes
};

std::string textOf(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text(kMaxBytes + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (file.bad() || (file.fail() && !file.eof())) refuse("it cannot be read; check the path");
  text.resize(static_cast<std::size_t>(file.gcount()));
  if (text.size() > kMaxBytes) refuse("it is larger than 1 MB");
  return text;
}

}  // namespace

YAML::Node loadYamlFile(const std::string& path) {
  return parseYaml(textOf(path));
}

YAML::Node parseYaml(const std::string& text) {
  std::istringstream stream(text);
  YAML::Parser parser(stream);
  Bounds bounds;
  while (parser.HandleNextDocument(bounds)) {
  }
  return YAML::Load(text);
}

}  // namespace bki_mapping
