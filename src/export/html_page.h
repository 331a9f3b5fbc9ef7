/// @file The frame of an exported page: HTML, style, scripts and three.js in one file.
#pragma once

#include <functional>
#include <string>

namespace bki_mapping {

/// Takes the parts of a page, in their order.
using PageWriter = std::function<void(const std::string&)>;

/// Writes web/viewer.html with the files of web/ that it names and with three.js in place of their names.
/// @param three_js path of three.js; "": where libjs-three installs it. @param write_map writes the map,
/// where the page has its place. @throws std::runtime_error, before anything is written, if a file is
/// missing.
void writePage(const std::string& three_js, const PageWriter& write, const std::function<void()>& write_map);

/// The path of three.js. @param given or "", for where libjs-three installs it.
/// @throws std::runtime_error that says what to install.
std::string findThreeJs(const std::string& given);

/// Text as JSON that cannot end an HTML element: `<`, `>` and `&` are escaped. Bytes that are not UTF-8
/// become U+FFFD. @param json as nlohmann's dump() returns it, with ASCII only.
std::string safeInHtml(const std::string& json);

std::string base64(const std::string& bytes);

}  // namespace bki_mapping
