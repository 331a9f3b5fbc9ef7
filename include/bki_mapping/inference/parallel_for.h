/// @file Independent jobs on several threads; the only place that starts threads in the core.
#pragma once

#include <cstddef>
#include <functional>

namespace bki_mapping {

/// @return the number of threads meant by a setting: itself, or all cores if it is 0.
int threadCount(int setting);

/// Calls job(j, worker) for each j in [0, jobs), on `threads` threads, the caller's among them; returns when
/// all are done. Jobs must not depend on each other. `worker` in [0, threads) tells threads apart.
/// @throws what the first failing job threw; jobs not yet begun are then left out.
void parallelFor(std::size_t jobs, int threads,
                 const std::function<void(std::size_t job, std::size_t worker)>& job);

}  // namespace bki_mapping
