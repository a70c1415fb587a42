// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/pipeline/given_value.hpp"

#include <nlohmann/json.hpp>

#include "marrow/base/yaml.hpp"

namespace marrow {
namespace {

constexpr const char* kOpening = "[{\"'";

std::string beginning_of(const std::string& text) {
  return text[0] == '['   ? "the value begins as a list"
         : text[0] == '{' ? "the value begins as a map"
                          : "the value begins as a quoted text";
}

bool is_of_form(const YAML::Node& value, const std::string& text) {
  const char closing = text[0] == '[' ? ']' : text[0] == '{' ? '}' : text[0];
  if (text[text.find_last_not_of(' ')] != closing) return false;
  return text[0] == '[' ? value.IsSequence() : text[0] == '{' ? value.IsMap() : value.IsScalar();
}

}  // namespace

std::optional<YAML::Node> given_value(const std::string& text, const Place& place, Diagnostics& diagnostics) {
  if (text.find_first_of(kOpening) != 0) return YAML::Node(text);
  std::string why = "it does not end as one";
  try {
    if (text.find_first_of("\r\n") != std::string::npos) throw YAML::Exception({}, "it must be in one line");
    // Inside a list of one item, neither a comment nor another value can follow the text.
    const YAML::Node all = parse_yaml("[" + text + "]");
    if (all.IsSequence() && all.size() == 1 && is_of_form(all[0], text)) return all[0];
  } catch (const YAML::Exception& fault) {
    why = fault.msg;
  }
  const std::string inside =
      text[0] == '[' || text[0] == '{' ? "a text in it with ' #', ': ', &, ! or * needs quotes; " : "";
  const std::string quoted = nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  diagnostics.add(place, beginning_of(text) + ", but cannot be read as one: " + why,
                  inside + "to give it as a text, put it in double quotes: " + cut(quoted, 200));
  return std::nullopt;
}

std::string text_to_give(const YAML::Node& value) {
  if (value.IsScalar() && value.Scalar().find_first_of(kOpening) != 0) return value.Scalar();
  YAML::Emitter out;
  out << YAML::Flow << value;
  return out.c_str();
}

}  // namespace marrow
