// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/json_text.hpp"

#include <algorithm>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow {
namespace {

constexpr int kMostJsonLevels = 64;

/// How deep lists and objects are nested. Brackets inside texts do not count.
int levels_of(const std::string& text) {
  int level = 0, most = 0;
  bool in_text = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_text && c == '\\')
      ++i;
    else if (c == '"')
      in_text = !in_text;
    else if (!in_text && (c == '[' || c == '{'))
      most = std::max(most, ++level);
    else if (!in_text && (c == ']' || c == '}'))
      --level;
  }
  return most;
}

std::string place_in(const std::string& text, std::size_t byte) {
  const std::size_t at = std::min(byte ? byte - 1 : 0, text.size());
  const auto line = 1 + std::count(text.begin(), text.begin() + std::ptrdiff_t(at), '\n');
  const std::size_t before = at ? text.rfind('\n', at - 1) : std::string::npos;
  return formatted("{}:{}", line, before == std::string::npos ? at + 1 : at - before);
}

/// Clears the leaves first, because the destructor of an empty list or object does not allocate.
void take_apart(nlohmann::json& value) {
  if (!value.is_structured()) return;
  for (nlohmann::json& item : value) take_apart(item);
  value.clear();
}

}  // namespace

JsonDocument::~JsonDocument() { take_apart(value_); }

nlohmann::json parse_json(const std::string& text, const std::string& what) {
  if (levels_of(text) > kMostJsonLevels)
    throw Error(formatted("{}: lists and objects are nested more than {} deep", what, kMostJsonLevels));
  try {
    return nlohmann::json::parse(text);
  } catch (const nlohmann::json::parse_error& fault) {
    throw Error(what + ":" + place_in(text, fault.byte) + ": not valid JSON");
  } catch (const nlohmann::json::exception&) {
    throw Error(what + ": not valid JSON: a number in it is too large");
  }
}

std::int64_t integer_of(const nlohmann::json& value, std::int64_t least, std::int64_t most, const std::string& what) {
  const std::string expected = formatted("expected a whole number from {} to {}", least, most);
  if (!value.is_number_integer()) throw Error(what + ": " + expected);
  const bool is_huge = value.is_number_unsigned() && value.get<std::uint64_t>() > std::uint64_t(INT64_MAX);
  const std::int64_t number = is_huge ? 0 : value.get<std::int64_t>();
  if (is_huge || number < least || number > most) throw Error(what + " is " + value.dump() + "; " + expected);
  return number;
}

std::string json_text(const nlohmann::json& value, int indent) {
  return value.dump(indent, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace marrow
