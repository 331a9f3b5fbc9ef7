/// @file The priority of threads.
#pragma once

namespace bki_mapping {

/// Gives other threads of the process priority over the calling one: publishing and corrections may wait, a
/// scan may not.
void yieldToOtherThreads();

}  // namespace bki_mapping
