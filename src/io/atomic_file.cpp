#include "bki_mapping/io/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <vector>

namespace bki_mapping {
namespace {

[[noreturn]] void fail(const std::string& path, const std::string& what) {
  throw std::runtime_error(path + " cannot be written: " + what + "; check folder, rights and free space");
}

}  // namespace

AtomicFile::AtomicFile(const std::string& path) : path_(path) {
  const std::string pattern = path + ".XXXXXX";
  std::vector<char> name(pattern.begin(), pattern.end());
  name.push_back('\0');
  const int file = mkstemp(name.data());
  if (file < 0) fail(path_, std::strerror(errno));
  fchmod(file, 0644);
  close(file);
  temporary_ = name.data();
}

AtomicFile::~AtomicFile() {
  if (!committed_) std::remove(temporary_.c_str());
}

void AtomicFile::commit() {
  const int file = open(temporary_.c_str(), O_RDONLY);
  const bool synced = file >= 0 && fsync(file) == 0;
  const int reason = errno;
  if (file >= 0) close(file);
  if (!synced) fail(path_, std::strerror(reason));
  if (std::rename(temporary_.c_str(), path_.c_str()) != 0) fail(path_, std::strerror(errno));
  committed_ = true;
}

void writeTextFile(const std::string& path, const std::string& text) {
  AtomicFile file(path);
  std::ofstream out(file.temporaryPath(), std::ios::binary);
  out << text;
  out.close();
  if (!out) fail(path, std::strerror(errno));
  file.commit();
}

}  // namespace bki_mapping
