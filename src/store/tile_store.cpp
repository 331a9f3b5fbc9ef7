#include "store/tile_store.h"

#include <algorithm>
#include <iterator>
#include <memory>
#include <new>
#include <stdexcept>
#include <utility>

namespace bki_mapping {
namespace {

/// One change of the file takes jobs until they hold this much memory [bytes].
constexpr std::size_t kChangeBytes = 64 << 20;

/// std::function requires that its target can be copied, and maps cannot be copied.
std::shared_ptr<SemanticMap> shared(SemanticMap map) {
  return std::make_shared<SemanticMap>(std::move(map));
}

}  // namespace

TileStore::TileStore(MapFile file, bool journalled, std::chrono::milliseconds retry)
    : file_(std::move(file)), journalled_(journalled), retry_(retry), thread_([this] { run(); }) {}

TileStore::~TileStore() {
  close();
}

TileStore::Call TileStore::load(const GridIndex& tile) {
  const auto work = [this, tile](MapFile& file, MapFile::Change&, Call call) {
    Arrival arrival{Arrival::Kind::kLoaded, tile, file.info().emptyMap(), call};
    try {
      file.addTileTo(arrival.map, {tile});
    } catch (const MapFileDamaged&) {
      arrival.kind = Arrival::Kind::kDamaged;
    }
    arrive(std::move(arrival));
    return false;
  };
  return enqueue({work});
}

void TileStore::replace(const GridIndex& tile, SemanticMap map) {
  const std::size_t bytes = map.bytes();
  const auto work = [tile, map = shared(std::move(map))](MapFile&, MapFile::Change& change, Call) {
    change.writeTile(*map, {tile});
    return true;
  };
  enqueue({work, bytes});
}

void TileStore::add(const GridIndex& tile, SemanticMap map) {
  const std::size_t bytes = map.bytes();
  const auto work = [this, tile, map = shared(std::move(map))](MapFile& file, MapFile::Change& change,
                                                               Call call) {
    SemanticMap sum = map->snapshot();
    try {
      file.addTileTo(sum, {tile});
    } catch (const MapFileDamaged&) {
      arrive({Arrival::Kind::kReturned, tile, std::move(sum), call});
      return false;
    }
    change.writeTile(sum, {tile});
    return true;
  };
  enqueue({work, bytes});
}

std::future<void> TileStore::save(SemanticMap snapshot, std::vector<GridIndex> tiles,
                                  const DriveRecord& drive, JournalChange journal) {
  const auto work = [map = shared(std::move(snapshot)), tiles = std::move(tiles), drive,
                     journal = std::move(journal)](MapFile&, MapFile::Change& change, Call) {
    for (const GridIndex& tile : tiles) change.writeTile(*map, {tile});
    if (drive.scans > 0) change.putDrive(drive);
    for (const std::string& settings : journal.settings) change.addSettings(settings);
    const auto unlessInvalid = [](const auto& put) {
      try {
        put();
      } catch (const std::invalid_argument&) {  // the map has such a scan all the same; its journal lacks it
      }
    };
    for (const JournalChange::Added& each : journal.added) {
      unlessInvalid([&] { change.addScan(each.scan, each.content()); });
    }
    for (const ScanRecord& scan : journal.moved) {
      unlessInvalid([&] { change.moveScan(scan); });
    }
    return true;
  };
  std::promise<void> durable;
  std::future<void> future = durable.get_future();
  // The memory of a snapshot is mostly that of the map.
  enqueue({work, 0, std::move(durable), false, false, true});
  return future;
}

TileStore::Call TileStore::clear() {
  const auto work = [](MapFile& file, MapFile::Change& change, Call) {
    for (const int part : file.parts()) {
      for (const TileEntry& tile : file.tiles(part)) change.eraseTile({tile.index, part});
    }
    for (const DriveRecord& drive : file.drives()) change.eraseDrive(drive.id);
    change.eraseJournal();
    return true;
  };
  return enqueue({work, 0, std::nullopt, true, false, true});
}

void TileStore::changeTiles(std::vector<GridIndex> tiles, std::function<void(SemanticMap&)> change_tile) {
  const auto work = [this, tiles = std::move(tiles), change_tile = std::move(change_tile)](
                        MapFile& file, MapFile::Change& change, Call call) {
    for (const GridIndex& tile : tiles) {
      SemanticMap map = file.info().emptyMap();
      try {
        if (!file.addTileTo(map, {tile})) continue;
      } catch (const MapFileDamaged&) {
        arrive({Arrival::Kind::kReturned, tile, std::move(map), call});
        continue;
      }
      change_tile(map);
      change.writeTile(map, {tile});
    }
    return true;
  };
  enqueue({work});
}

void TileStore::putDrive(const DriveRecord& drive) {
  const auto work = [drive](MapFile&, MapFile::Change& change, Call) {
    change.putDrive(drive);
    return true;
  };
  enqueue({work});
}

void TileStore::eraseJournal() {
  const auto work = [](MapFile&, MapFile::Change& change, Call) {
    change.eraseJournal();
    return true;
  };
  enqueue({work, 0, std::nullopt, false, false, true});
}

void TileStore::noteCleared(const Eigen::AlignedBox3d& box) {
  const auto work = [box](MapFile&, MapFile::Change& change, Call) {
    change.addClearedBox(box);
    return true;
  };
  enqueue({work});
}

std::string TileStore::scanContent(std::uint64_t number) {
  auto content = std::make_shared<std::promise<std::string>>();
  std::future<std::string> future = content->get_future();
  Work work = [number, content = std::move(content)](MapFile& file, MapFile::Change&, Call) {
    try {
      content->set_value(file.scanContent(number));
    } catch (...) {
      content->set_exception(std::current_exception());
    }
    return false;
  };
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (closed_) throw MapFileError("the map file is closed");
    Job job{std::move(work)};  // whose end is the end of the promise
    job.reads = true;
    jobs_.push_back(std::move(job));
    ++called_;
  }
  wake_.notify_all();
  try {
    return future.get();
  } catch (const std::future_error&) {
    throw MapFileError("the map file was closed");
  }
}

std::future<void> TileStore::copyTo(const std::string& path) {
  auto done = std::make_shared<std::promise<void>>();
  const auto work = [path, done](MapFile& file, MapFile::Change&, Call) {
    try {
      copyMap(file, path);
      done->set_value();
    } catch (...) {
      done->set_exception(std::current_exception());
    }
    return false;
  };
  enqueue({work, 0, std::nullopt, true});
  return done->get_future();
}

std::vector<TileStore::Arrival> TileStore::takeArrivals() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return std::exchange(arrivals_, {});
}

void TileStore::waitForTrial() {
  std::unique_lock<std::mutex> lock(mutex_);
  const Call called = called_;
  const std::size_t failures = failures_;
  tried_.wait(lock, [&] { return ended_ + executed_ >= called || failures_ > failures || closing_; });
}

std::string TileStore::fault() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return fault_;
}

std::size_t TileStore::waitingBytes() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return waiting_bytes_;
}

std::string TileStore::close() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    closing_ = true;
  }
  wake_.notify_all();
  if (thread_.joinable()) thread_.join();
  file_.reset();
  std::deque<Job> left;
  left.swap(jobs_);  // nobody adds any after closed_; whoever waits for one of them is told
  if (std::all_of(left.begin(), left.end(), [](const Job& job) { return job.reads || job.done; })) return "";
  return fault_ + "; evidence that was not yet in the map file is lost";
}

TileStore::Call TileStore::enqueue(Job job) {
  const std::lock_guard<std::mutex> lock(mutex_);
  waiting_bytes_ += job.bytes;
  jobs_.push_back(std::move(job));
  wake_.notify_all();
  return ++called_;
}

void TileStore::arrive(Arrival arrival) {
  const std::lock_guard<std::mutex> lock(mutex_);
  arrivals_.push_back(std::move(arrival));
}

void TileStore::run() {
  std::unique_lock<std::mutex> lock(mutex_);
  for (;;) {
    wake_.wait(lock, [this] { return closing_ || jobs_.size() > executed_; });
    if (jobs_.size() == executed_) break;
    const bool last_trial = closing_;
    if (tryJobs(lock)) continue;
    if (last_trial) break;
    wake_.wait_for(lock, retry_, [this] { return closing_; });
  }
  change_.reset();
  closed_ = true;
  for (Job& job : jobs_) {
    if (job.durable) job.durable->set_exception(std::make_exception_ptr(MapFileError(fault_)));
  }
}

bool TileStore::tryJobs(std::unique_lock<std::mutex>& lock) {
  // References to elements of a deque stay valid when others are appended.
  std::vector<Job*> jobs;
  std::size_t bytes = 0;
  bool ends = !journalled_;
  for (auto job = jobs_.begin() + static_cast<std::ptrdiff_t>(executed_); job != jobs_.end(); ++job) {
    if (!jobs.empty() && (job->first || bytes + job->bytes > kChangeBytes)) break;
    jobs.push_back(&*job);
    bytes += job->bytes;
    if (journalled_ && (ends = job->whole)) break;
  }
  const Call call = ended_ + executed_;
  lock.unlock();
  bool late = false, committed = false;
  const std::string fault = perform(jobs, call, ends, late, committed);
  lock.lock();
  fault_ = fault;
  if (!fault.empty()) {
    if (committed) last_trial_ = executed_ + jobs.size();
    executed_ = 0;
    ++failures_;
  } else if (late) {
    end(last_trial_, lock);
  } else {
    executed_ += jobs.size();
    if (!change_) end(executed_, lock);
  }
  tried_.notify_all();
  return fault.empty();
}

std::string TileStore::perform(const std::vector<Job*>& jobs, Call call, bool ends, bool& late,
                               bool& committed) {
  std::string fault;
  try {
    if (!change_) change_.emplace(file_->change());
    for (Job* job : jobs) {
      ++call;
      if (job->done) continue;
      job->done = !job->work(*file_, *change_, call);
      writes_ |= !job->done;
      if (!change_->isOpen()) {
        throw MapFileError(file_->path() + " could not be read; what was not saved yet is written again");
      }
    }
    if (writes_ && !ends) return "";
    if (writes_) {
      committed = true;
      change_->commit();
    }
  } catch (const MapFileLateCommit&) {  // the previous trial succeeded after all
    late = true;
  } catch (const std::bad_alloc&) {
    fault = "there is not enough memory to write to " + file_->path();
  } catch (const std::exception& error) {
    fault = error.what();
  }
  change_.reset();
  writes_ = false;
  return fault;
}

void TileStore::end(std::size_t jobs, std::unique_lock<std::mutex>& lock) {
  std::vector<Job> ended;
  const auto end = jobs_.begin() + static_cast<std::ptrdiff_t>(jobs);
  ended.assign(std::make_move_iterator(jobs_.begin()), std::make_move_iterator(end));
  jobs_.erase(jobs_.begin(), end);
  for (const Job& job : ended) waiting_bytes_ -= job.bytes;
  ended_ += jobs;
  executed_ = 0;
  lock.unlock();
  for (Job& job : ended) {
    if (job.durable) job.durable->set_value();
  }
  ended.clear();  // frees the maps while the lock is released
  lock.lock();
}

}  // namespace bki_mapping
