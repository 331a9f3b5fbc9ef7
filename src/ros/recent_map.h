/// @file The map that queries are answered from.
#pragma once

#include <ros/callback_queue.h>
#include <std_msgs/Header.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/query/state_map.h"

namespace bki_mapping::ros_interface {

/// A snapshot of the map, prepared for queries. All functions may be called from several threads at once.
struct QueriedMap {
  QueriedMap(std_msgs::Header of_map, MapSnapshot snapshot, const ClassTable& table)
      : header(std::move(of_map)),
        map(std::move(snapshot.map)),
        classes(table),
        states(map, snapshot.rules, kThreads) {}
  /// The same, but takes over what queries of an earlier snapshot have found out of what has not changed.
  QueriedMap(std_msgs::Header of_map, MapSnapshot snapshot, const ClassTable& table,
             const QueriedMap& earlier)
      : header(std::move(of_map)),
        map(std::move(snapshot.map)),
        classes(table),
        states(map, snapshot.rules, earlier.states, kThreads) {}

  std_msgs::Header header;  ///< map frame, stamp of the last scan
  SemanticMap map;
  const ClassTable& classes;  ///< the server's; never changes
  StateMap states;

 private:
  static constexpr int kThreads = 1;  ///< the others belong to mapping
};

/// Keeps a snapshot of the map as it was after its last change, so that queries need not wait until the
/// mapping thread has finished a scan. While the map has a snapshot, each scan copies the blocks that it
/// writes to. Therefore snapshots are taken only while queries are asked: from the first one, which waits for
/// the mapping thread, until some time after the last one.
class RecentMap {
 public:
  using Clock = std::chrono::steady_clock;
  using Shared = std::shared_ptr<const QueriedMap>;
  /// Takes a snapshot. @param earlier the one before, or nullptr.
  using Take = std::function<Shared(const QueriedMap* earlier)>;

  /// @param take is called in the mapping thread. @param mapping the queue that this thread serves.
  /// @param background the queue of the thread that prepares and frees snapshots.
  /// @param interest how long snapshots are taken, and prepared, after a query.
  RecentMap(Take take, ros::CallbackQueue& mapping, ros::CallbackQueue& background,
            Clock::duration interest = std::chrono::seconds(10))
      : take_(std::move(take)), mapping_(mapping), background_(background), interest_(interest) {}

  /// The map as it was after its last change. For the threads of queries.
  /// @throws std::bad_alloc, and std::future_error when the server shuts down.
  Shared get();
  /// The same for a query of the frontiers of the whole map, which takes long. They are found ahead in the
  /// snapshots after it, in the background, as long as such queries are asked.
  Shared getForFrontiers() {
    frontiers_asked_ = Clock::now();
    return get();
  }
  /// Takes a snapshot of the changed map if queries are asked. For the mapping thread, after each change.
  void changed() noexcept;
  /// Gives the snapshot up if no queries are asked any more. For the mapping thread, now and then.
  void releaseIfIdle() noexcept;

 private:
  using Time = std::atomic<Clock::time_point>;
  /// The clock's epoch will not do: it may be the last start of the machine, and so be recent.
  static constexpr Clock::time_point kNever = Clock::time_point::min();

  /// Replaces the snapshot.
  void keep(Shared snapshot) noexcept;
  /// Finds the frontiers of the snapshot ahead, until there is a newer one.
  void prepare(const Shared& snapshot);
  /// Calls a function in the background; drops it at once if there is no memory for that.
  template <typename Function>
  void later(Function function) noexcept;
  bool isRecent(const Time& asked) const {
    const Clock::time_point last = asked;
    return last != kNever && Clock::now() - last <= interest_;
  }

  Take take_;
  ros::CallbackQueue& mapping_;
  ros::CallbackQueue& background_;
  Clock::duration interest_;
  Time asked_{kNever}, frontiers_asked_{kNever};
  std::mutex mutex_;
  Shared kept_;  ///< nullptr while no queries are asked
};

}  // namespace bki_mapping::ros_interface
