#include "export/html_page.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>

#include "settings/named_file.h"

namespace bki_mapping {
namespace {

constexpr const char* kThreeJs[] = {"/usr/share/javascript/three/three.min.js",
                                    "/usr/share/javascript/three/three.js"};

std::string readText(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file || text.empty()) {
    throw std::runtime_error("the page needs " + path + ", which cannot be read; install the package again");
  }
  return text;
}

std::string partOfPage(const std::string& name) {
  return readText((std::filesystem::path(sharePath()) / "web" / name).string());
}

/// A script in an HTML element. In scripts, `<\/` means the same as `</`, but does not end the element.
std::string scriptElement(std::string script) {
  const std::string end = "</script";
  for (std::size_t at = 0; (at = script.find(end, at)) != std::string::npos; at += end.size()) {
    script.insert(at + 1, "\\");
  }
  return "<script>\n" + script + "</script>\n";
}

/// What is between two texts in a line; "" if the line does not have both.
std::string between(const std::string& line, const std::string& before, const std::string& after) {
  const std::size_t begin = line.find(before), from = begin + before.size();
  const std::size_t end = begin == std::string::npos ? begin : line.find(after, from);
  return end == std::string::npos ? "" : line.substr(from, end - from);
}

}  // namespace

std::string findThreeJs(const std::string& given) {
  namespace fs = std::filesystem;
  std::error_code missing;
  if (!given.empty()) {
    if (fs::is_regular_file(given, missing)) return given;
    throw std::runtime_error("three.js is not in " + given);
  }
  for (const char* const path : kThreeJs) {
    if (fs::is_regular_file(path, missing)) return path;
  }
  throw std::runtime_error(std::string("the page needs three.js, which is not in ") + kThreeJs[0] +
                           "; install it with: sudo apt-get install libjs-three");
}

void writePage(const std::string& three_js, const PageWriter& write, const std::function<void()>& write_map) {
  const std::string library = scriptElement(readText(findThreeJs(three_js)));
  const std::string license = partOfPage("three_license.txt");
  std::istringstream page(partOfPage("viewer.html"));
  for (std::string line; std::getline(page, line);) {
    const std::string style = between(line, "<link rel=\"stylesheet\" href=\"", "\">");
    const std::string script = between(line, "<script src=\"", "\"></script>");
    if (!style.empty()) {
      write("<style>\n" + partOfPage(style) + "</style>\n");
    } else if (!script.empty()) {
      write(scriptElement(partOfPage(script)));
    } else if (line == "<!-- map -->") {
      write_map();
    } else if (line == "<!-- three.js -->") {
      write("<!--\n" + license + "-->\n");
      write(library);
    } else {
      write(line + "\n");
    }
  }
}

std::string safeInHtml(const std::string& json) {
  std::string safe;
  safe.reserve(json.size());
  for (const char c : json) {
    if (c == '<') {
      safe += "\\u003c";
    } else if (c == '>') {
      safe += "\\u003e";
    } else if (c == '&') {
      safe += "\\u0026";
    } else {
      safe += c;
    }
  }
  return safe;
}

std::string base64(const std::string& bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const auto byte = [&](std::size_t n) {
      return i + n < bytes.size() ? static_cast<unsigned char>(bytes[i + n]) : 0u;
    };
    const unsigned group = byte(0) << 16 | byte(1) << 8 | byte(2);
    text += kDigits[group >> 18];
    text += kDigits[group >> 12 & 63];
    text += i + 1 < bytes.size() ? kDigits[group >> 6 & 63] : '=';
    text += i + 2 < bytes.size() ? kDigits[group & 63] : '=';
  }
  return text;
}

}  // namespace bki_mapping
