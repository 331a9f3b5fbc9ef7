#include "tools/interruption.h"

#include <unistd.h>

#include <cerrno>

namespace bki_mapping::tools {
namespace {

constexpr int kSignals[] = {SIGINT, SIGTERM};

void note(int);

/// The disposition of a signal is the only state: once a signal has come, note() is no longer its handler.
bool isNoted(int signal) {
  struct sigaction now {};
  return sigaction(signal, nullptr, &now) == 0 && now.sa_handler == note;
}

void handle(int signal, void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART;
  sigemptyset(&action.sa_mask);
  for (const int other : kSignals) sigaddset(&action.sa_mask, other);
  sigaction(signal, &action, nullptr);
}

/// Lets the next signal end the process. Calls nothing but functions that are safe in signal handlers.
void note(int) {
  constexpr char kNotice[] = "\nstopping; another signal ends the program at once\n";
  const int error = errno;
  for (const int signal : kSignals) {
    if (isNoted(signal)) handle(signal, SIG_DFL);
  }
  if (write(STDERR_FILENO, kNotice, sizeof kNotice - 1) < 0) errno = error;
  errno = error;
}

}  // namespace

Interruption::Interruption() {
  for (const int signal : kSignals) {
    struct sigaction before {};
    if (sigaction(signal, nullptr, &before) != 0 || before.sa_handler == SIG_IGN) continue;
    handle(signal, note);
    signals_.push_back(signal);
  }
}

Interruption::~Interruption() {
  for (const int signal : signals_) handle(signal, SIG_DFL);
}

bool Interruption::requested() const {
  for (const int signal : signals_) {
    if (!isNoted(signal)) return true;
  }
  return false;
}

}  // namespace bki_mapping::tools
