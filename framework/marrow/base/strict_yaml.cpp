// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/strict_yaml.hpp"

#include <algorithm>
#include <cctype>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/plain_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/text_file.hpp"
#include "marrow/base/yaml.hpp"

namespace marrow {

namespace {

/// What to do about a fault that the parser words for those who know YAML's grammar.
std::string hint_of(const std::string& fault) {
  if (fault.find("illegal map value") != std::string::npos)
    return "write a text that has a colon and a blank in it in quotes, as  help: \"edges: Canny's\"";
  if (fault.find("unknown token") != std::string::npos) return "write a text that begins with @, ` or % in quotes";
  return "";
}

/// Whether a bracket or quote after this character begins something. Inside a word, as in "bone's", it is text.
bool begins_after(char before) {
  return std::isspace(static_cast<unsigned char>(before)) || before == '{' || before == '[' || before == ',';
}

}  // namespace

YAML::Node StrictYaml::parse(const std::string& text) { return parsed(plain_text(text), 0); }

YAML::Node StrictYaml::parse_also(const std::string& file, const std::string& text) {
  further_.push_back({file, lines_});
  return parsed(plain_text(text), lines_);
}

YAML::Node StrictYaml::parsed(const std::string& text, int first_line) {
  lines_ = first_line + int(std::count(text.begin(), text.end(), '\n')) + 1;
  try {
    return parse_yaml(std::string(std::size_t(first_line), '\n') + text);
  } catch (const YAML::ParserException& error) {
    fault(place_of(error.mark), "not valid YAML: " + error.msg, hint_of(error.msg));
    // The parser reports where the text ends or makes no sense. The mistake is where a bracket or quote was left open.
    if (const auto opened = last_unclosed(text))
      fault({place_of(error.mark).file, opened->line, opened->column},
            std::string("this ") + opened->mark + " is not closed");
  } catch (const YAML::Exception& error) {
    fault(place_of(error.mark), "cannot be read as YAML: " + error.msg);
  }
  return {};
}

Place StrictYaml::place_of(const YAML::Mark& mark) const {
  if (only_) return *only_;
  for (std::size_t i = further_.size(); i-- > 0;)
    if (mark.line >= further_[i].first_line)
      return {further_[i].name, mark.line - further_[i].first_line + 1, mark.column + 1};
  return {file_, mark.line + 1, mark.column + 1};
}

std::vector<YamlEntry> StrictYaml::map(const YAML::Node& node, const Place& where, const std::string& what,
                                       const std::vector<std::string>* known) {
  std::vector<YamlEntry> entries;
  if (!node.IsMap()) {
    fault(where, what + " must be a map, got " + yaml_described(node), "write it as  key: value  lines");
    return entries;
  }
  std::vector<YamlFault> faults;
  for (const YamlKey& key : yaml_keys(node, what, faults)) {
    const Place key_place = place_of(key.mark);
    if (known && std::find(known->begin(), known->end(), key.name) == known->end())
      fault(key_place, "unknown key " + in_quotes(key.name) + " in " + what, suggestion(key.name, *known));
    else
      entries.push_back({key.name, key_place, key.value});
  }
  for (const YamlFault& one : faults) fault(place_of(one.mark), one.text, one.hint);
  return entries;
}

std::optional<std::string> StrictYaml::text(const YAML::Node& node, const Place& where, const std::string& what) {
  if (node.IsScalar()) return node.Scalar();
  fault(where, what + ": expected a text, got " + yaml_described(node));
  return std::nullopt;
}

std::optional<bool> StrictYaml::boolean(const YAML::Node& node, const Place& where, const std::string& what) {
  const std::optional<bool> value = yaml_boolean(node);
  if (!value) fault(where, what + ": expected true or false, got " + yaml_described(node));
  return value;
}

std::optional<std::int64_t> StrictYaml::integer(const YAML::Node& node, const Place& where, const std::string& what) {
  const std::optional<std::int64_t> value = yaml_integer(node);
  if (!value)
    fault(where, what + ": expected an integer, got " + yaml_described(node),
          has_leading_zeros(node) ? "write it without leading zeros" : "");
  return value;
}

std::optional<double> StrictYaml::number(const YAML::Node& node, const Place& where, const std::string& what) {
  const std::optional<double> value = yaml_number(node);
  if (!value) fault(where, what + ": expected a number, got " + yaml_described(node));
  return value;
}

std::optional<std::string> read_source(const std::filesystem::path& file, const std::string& what,
                                       Diagnostics& diagnostics) {
  try {
    std::string text = read_given_text(file, kMostSourceBytes);
    diagnostics.remember(file.string(), plain_text(text));
    return text;
  } catch (const Error& error) {
    const std::string fault = error.what();  // begins with the file's name, which the place has already
    const auto says = [&](const char* part) { return fault.find(part, file.string().size()) != std::string::npos; };
    const bool is_stream = says(", not a regular file") && !says(" is a folder");
    const char* hint = says(" is longer than ") ? ""
                       : is_stream              ? "write the text to a file and give that"
                                                : "check the path";
    diagnostics.add({file.string()}, what + fault.substr(file.string().size()), hint);
    return std::nullopt;
  }
}

std::optional<Unclosed> last_unclosed(const std::string& text) {
  std::vector<Unclosed> open;
  int line = 1, column = 0;
  bool in_comment = false;
  char before = '\n';
  for (std::size_t i = 0; i < text.size(); before = text[i++]) {
    const char c = text[i];
    ++column;
    if (c == '\n') {
      ++line;
      column = 0;
      in_comment = false;
    }
    const bool quoted = !open.empty() && (open.back().mark == '"' || open.back().mark == '\'');
    if (in_comment) continue;
    if (quoted) {
      // An escaped character does not end a quote. An escaped line break still counts as a line.
      if (c == '\\' && open.back().mark == '"' && text.compare(i + 1, 1, "\n") != 0)
        ++i, ++column;
      else if (c == open.back().mark)
        open.pop_back();
      continue;
    }
    if (c == '#' && std::isspace(static_cast<unsigned char>(before))) in_comment = true;
    if ((c == '{' || c == '[' || c == '"' || c == '\'') && begins_after(before)) open.push_back({c, line, column});
    if ((c == '}' || c == ']') && !open.empty()) {
      if (open.back().mark != (c == '}' ? '{' : '[')) break;
      open.pop_back();
    }
  }
  if (open.empty()) return std::nullopt;
  return open.back();
}

}  // namespace marrow
