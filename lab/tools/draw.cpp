#include "tools/draw.h"

#include <sys/wait.h>

#include <cstdlib>
#include <stdexcept>

#include "settings/named_file.h"

namespace bki_mapping::tools {
namespace {

std::string quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) result += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return result + "'";
}

}  // namespace

void draw(const std::string& name, const std::vector<std::string>& arguments) {
  const std::string program = sharePath() + "/lab/tools/" + name;
  std::string command = "/usr/bin/python3 " + quoted(program);
  for (const std::string& argument : arguments) command += " " + quoted(argument);
  const int status = std::system(command.c_str());
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    throw std::runtime_error("the measurements are written, but not drawn: " + program +
                             " failed; it needs python3-matplotlib");
  }
}

}  // namespace bki_mapping::tools
