#include "store/simulated_disk.h"

#include <algorithm>
#include <stdexcept>

namespace bki_mapping {

SimulatedDisk::SimulatedDisk(const std::string& folder, const Files& files) : folder_(folder) {
  for (const auto& [name, bytes] : files) names_[name] = {std::make_shared<File>(File{bytes, {}})};
}

void SimulatedDisk::setName(const std::string& path, FilePointer file) {
  std::vector<FilePointer>& history = names_[nameOf(path)];
  if (history.empty()) history.push_back(nullptr);
  history.push_back(std::move(file));
}

void SimulatedDisk::apply(const DiskCall& call) {
  const auto current = [&]() -> FilePointer& {
    FilePointer& file = names_.at(nameOf(call.path)).back();
    if (!file) throw std::logic_error(call.path + " is changed after its removal");
    return file;
  };
  switch (call.kind) {
    case DiskCall::Kind::kCreate:
      return setName(call.path, std::make_shared<File>());
    case DiskCall::Kind::kWrite:
    case DiskCall::Kind::kTruncate:
      return current()->pending.push_back(call);
    case DiskCall::Kind::kSync:
      for (const DiskCall& each : current()->pending) perform(each, current()->durable);
      return current()->pending.clear();
    case DiskCall::Kind::kSyncFolder:
      for (auto& [name, history] : names_) history.erase(history.begin(), history.end() - 1);
      return;
    case DiskCall::Kind::kRename:
      setName(call.target, current());
      return setName(call.path, nullptr);
    case DiskCall::Kind::kRemove:
      return setName(call.path, nullptr);
  }
}

void SimulatedDisk::perform(const DiskCall& call, std::string& bytes) {
  const auto position = static_cast<std::size_t>(call.position);
  if (call.kind == DiskCall::Kind::kTruncate) return bytes.resize(position);
  if (bytes.size() < position + call.bytes.size()) bytes.resize(position + call.bytes.size());
  bytes.replace(position, call.bytes.size(), call.bytes);
}

std::string SimulatedDisk::contentAfter(const File& file, Loss loss, std::mt19937& random) const {
  std::string bytes = file.durable;
  const std::size_t performed =
      loss == Loss::kTheLast ? random() % (file.pending.size() + 1) : file.pending.size();
  for (std::size_t c = 0; c < performed; ++c) {
    const DiskCall& call = file.pending[c];
    if (loss == Loss::kEverything || (loss == Loss::kSome && random() % 2 == 0)) continue;
    if (loss != Loss::kSectors || call.kind == DiskCall::Kind::kTruncate) {
      perform(call, bytes);
      continue;
    }
    for (std::size_t begin = 0; begin < call.bytes.size();) {
      const std::size_t position = static_cast<std::size_t>(call.position) + begin;
      const std::size_t size = std::min(kSector - position % kSector, call.bytes.size() - begin);
      DiskCall part = call;
      part.position = static_cast<std::int64_t>(position);
      part.bytes = call.bytes.substr(begin, size);
      if (random() % 2 == 0) perform(part, bytes);
      begin += size;
    }
  }
  return bytes;
}

Files SimulatedDisk::cut(Loss loss, std::mt19937& random) const {
  Files files;
  for (const auto& [name, history] : names_) {
    std::size_t chosen = random() % history.size();
    if (loss == Loss::kEverything) chosen = 0;
    if (loss == Loss::kNothing) chosen = history.size() - 1;
    if (history[chosen]) files[name] = contentAfter(*history[chosen], loss, random);
  }
  return files;
}

}  // namespace bki_mapping
