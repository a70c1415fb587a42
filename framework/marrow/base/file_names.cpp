// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/file_names.hpp"

#include <algorithm>
#include <set>

#include "marrow/base/hash.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"

namespace marrow {
namespace {

constexpr std::size_t kMostNameBytes = 100;   // bytes
constexpr std::size_t kMostInFileName = 200;  // with an extension and a temporary's prefix it is below the usual 255

/// As in URLs. `text` may have several bytes.
std::string percent_encoded(std::string_view text) {
  std::string result;
  for (const unsigned char byte : text) result += formatted("%{:02X}", byte);
  return result;
}

}  // namespace

std::string fault_of_name(const std::string& name) {
  if (name.empty()) return "it is empty";
  if (name.size() > kMostNameBytes) return formatted("it has {} bytes", name.size());
  if (name.find('/') != std::string::npos) return "it holds '/'";
  if (name.find('\\') != std::string::npos) return "it holds '\\'";
  if (const std::string odd = odd_character_in(name); !odd.empty()) return "it holds " + odd;
  if (name.front() == '.') return "it begins with a dot";
  if (name.front() == ' ') return "it begins with a space";
  if (name.back() == ' ') return "it ends with a space";
  return "";
}

void check_file_name(Diagnostics& diagnostics, const Place& place, const std::string& name, const std::string& what) {
  const std::string fault = fault_of_name(name);
  if (!fault.empty())
    diagnostics.add(place, what + " becomes a file name: " + in_quotes(name) + " cannot be one, " + fault, kNameHint);
}

std::string file_name_of(const std::string& text) {
  if (text.empty()) return "%";  // no other text becomes a percent sign alone
  std::string result;
  for (std::size_t i = 0, next = 0; i < text.size(); i = next) {
    next = i + 1;
    while (next < text.size() && goes_on(text[next])) ++next;  // one character
    const std::string character = text.substr(i, next - i);
    const bool is_special =
        std::string("/\\%~").find(character) != std::string::npos || !odd_character_in(character).empty() ||
        (i == 0 && (character == "." || character == " ")) || (next == text.size() && character == " ");
    result += is_special ? percent_encoded(character) : character;
  }
  if (result.size() <= kMostInFileName) return result;
  const std::string hash = "~" + hash_of(text).hex();
  std::size_t end = kMostInFileName - hash.size();
  while (goes_on(result[end])) --end;
  return result.substr(0, end) + hash;
}

std::vector<std::string> distinct_names(const std::vector<std::string>& names) {
  std::vector<std::string> result;
  std::set<std::string> given(names.begin(), names.end()), seen;
  std::map<std::string, int> last;
  for (const std::string& name : names) {
    std::string distinct = name;
    if (!seen.insert(name).second) {
      int& number = last.try_emplace(name, 1).first->second;
      do distinct = formatted("{} ({})", name, ++number);
      while (!given.insert(distinct).second);
    }
    result.push_back(distinct);
  }
  return result;
}

namespace fs = std::filesystem;

fs::path plain_path(const fs::path& path) {
  if (std::find(path.begin(), path.end(), "..") == path.end()) return path.lexically_normal();
  fs::path plain = path.root_path();
  for (const fs::path& part : path.relative_path()) {
    const bool is_up = part == "..", is_root = plain.has_root_directory() && !plain.has_relative_path();
    if (part.empty() || part == "." || (is_up && is_root)) continue;  // the parent of the root is the root
    std::error_code error;
    const bool goes_with_it = is_up && plain.filename() != ".." && fs::is_directory(fs::symlink_status(plain, error));
    if (goes_with_it)
      plain = plain.parent_path();
    else
      plain /= part;
  }
  const fs::path shortest = path.lexically_normal();
  if (plain.empty()) return shortest.empty() ? plain : ".";
  return !shortest.has_filename() && plain.has_filename() ? plain / "" : plain;
}

}  // namespace marrow
