#include "parallel/thread_priority.h"

#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace bki_mapping {

void yieldToOtherThreads() {
  constexpr int kNiceness = 19;  // the most
  // On Linux, niceness is a property of the thread, although POSIX speaks of the process.
  setpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)), kNiceness);
}

}  // namespace bki_mapping
