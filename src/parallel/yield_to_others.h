/// @file The priority of threads whose work may wait.
#pragma once

#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace bki_mapping {

/// Lets other threads of the process go before the calling one, as publishing and storing may wait and a scan
/// may not. (On Linux the niceness of a process means that of a thread.)
inline void yieldToOthers() {
  constexpr int kNiceness = 19;  // the most
  setpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)), kNiceness);
}

}  // namespace bki_mapping
