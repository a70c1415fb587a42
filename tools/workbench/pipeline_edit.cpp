// SPDX-License-Identifier: Apache-2.0
#include "workbench/pipeline.hpp"

#include <algorithm>

#include "marrow/base/json_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/yaml.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"
#include "workbench/yaml_text.hpp"

namespace marrow::workbench {
namespace {

using What = PipelineEdit::What;
using Entries = std::vector<YamlEntryText>;

constexpr std::size_t kWidth = 120;  // a longer line is broken

std::string replaced(const std::string& text, std::size_t begin, std::size_t end, const std::string& by) {
  return text.substr(0, begin) + by + text.substr(end);
}

bool has_comment(const std::string& text, std::size_t begin, std::size_t end) {
  return text.substr(begin, end - begin).find('#') != std::string::npos;
}

/// `entry` with another value. The new value follows the colon, even if the old one was on separate lines.
std::string with_value(const YamlText& yaml, const YamlEntryText& entry, const std::string& value) {
  const std::string& text = yaml.text();
  const bool is_below = text.substr(entry.colon, entry.value_begin - entry.colon).find('\n') != std::string::npos;
  if (is_below || entry.value_begin == entry.colon + 1)
    return replaced(text, entry.colon + 1, entry.value_end, " " + value);
  return replaced(text, entry.value_begin, entry.value_end, value);
}

std::string with_entry_in_braces(const YamlText& yaml, const YAML::Node& map, const std::string& entry) {
  const std::string& text = yaml.text();
  const Entries entries = yaml.entries(map);
  const std::size_t close = yaml.closing_brace(map);
  if (entries.empty()) return replaced(text, close, close, entry);
  std::size_t at = entries.back().value_end;
  const std::size_t comma = text.find_first_not_of(" \t", at);
  const bool has_comma = comma < text.size() && text[comma] == ',';
  if (has_comma) at = comma + 1;
  const std::string separator = has_comma ? "" : ",";
  const std::size_t width = yaml.column(yaml.line_end(at)) + separator.size() + 1 + entry.size();
  if (width <= kWidth) return replaced(text, at, at, separator + " " + entry);
  const std::size_t first = entries.front().key_begin;
  const bool spans = yaml.line_begin(first) != yaml.line_begin(entries.back().key_begin);
  const std::size_t indent = spans ? yaml.indent(entries.back().key_begin) : yaml.indent(first) + 2;
  return replaced(text, at, at, separator + yaml.newline() + std::string(indent, ' ') + entry);
}

/// A map with one more entry at its end.
std::string with_entry(const YamlText& yaml, const YAML::Node& map, const std::string& key, const std::string& value) {
  const std::string entry = yaml_scalar(key) + ": " + value;
  if (yaml.is_flow(map)) return with_entry_in_braces(yaml, map, entry);
  const Entries entries = yaml.entries(map);
  const std::size_t end = yaml.line_end(entries.back().value_end);
  const std::string indent(yaml.column(entries.front().key_begin), ' ');
  return replaced(yaml.text(), end, end, yaml.newline() + indent + entry);
}

std::string without_entry_in_braces(const YamlText& yaml, const Entries& entries, std::size_t i) {
  const std::string& text = yaml.text();
  const YamlEntryText& entry = entries[i];
  if (i + 1 < entries.size()) {
    const std::size_t next = entries[i + 1].key_begin;
    if (!has_comment(text, entry.value_end, next)) return replaced(text, entry.key_begin, next, "");
    const std::size_t comma = text.find(',', entry.value_end);
    return replaced(text, entry.key_begin, comma + 1, "");
  }
  if (i == 0) return replaced(text, entry.key_begin, entry.value_end, "");
  const std::size_t before = entries[i - 1].value_end;
  if (!has_comment(text, before, entry.key_begin)) return replaced(text, before, entry.value_end, "");
  const std::string rest = replaced(text, entry.key_begin, entry.value_end, "");
  const std::size_t comma = text.find(',', before);
  return replaced(rest, comma, comma + 1, "");
}

/// A map without one of its entries. It must have several.
std::string without_entry(const YamlText& yaml, const YAML::Node& map, const std::string& key) {
  const Entries entries = yaml.entries(map);
  const YamlEntryText& entry = *find_entry(entries, key);
  if (yaml.is_flow(map)) return without_entry_in_braces(yaml, entries, std::size_t(&entry - entries.data()));
  const std::string& text = yaml.text();
  const std::size_t begin = yaml.line_begin(entry.key_begin), end = yaml.line_end(entry.value_end);
  if (end == text.size() && begin > 0)  // the last line has no line break, so remove the one before it
    return replaced(text, yaml.line_end(begin - 1), end, "");
  return replaced(text, begin, std::min(text.size(), text.find('\n', end) + 1), "");
}

/// The map of the node that is edited.
YAML::Node node_of(const YAML::Node& root, const std::string& id) {
  const YAML::Node nodes = root.IsMap() ? root["nodes"] : YAML::Node();
  if (!nodes.IsDefined() || !nodes.IsMap()) throw Error("the pipeline has no nodes; change it in the text");
  std::vector<std::string> ids;
  for (const auto& pair : nodes)
    if (pair.first.IsScalar()) ids.push_back(pair.first.Scalar());
  if (!contains(ids, id))
    throw Error("the pipeline has no node " + in_quotes(printable(id)) + "; " + suggestion(id, ids));
  const YAML::Node node = nodes[id];
  if (!node.IsMap() || node.size() == 0)
    throw Error("node " + in_quotes(printable(id)) + " is no map; change it in the text");
  return node;
}

std::string section_of(const PipelineEdit& edit) { return edit.what == What::option ? "with" : "in"; }

std::string edit_section(const YamlText& yaml, const YAML::Node& node, const PipelineEdit& edit) {
  const std::string key = section_of(edit);
  const Entries parts = yaml.entries(node);
  const YamlEntryText* section = find_entry(parts, key);
  const bool is_map = section && section->value.IsMap();
  if (section && !is_map && !section->value.IsNull())
    throw Error(in_quotes(key) + " of node " + in_quotes(edit.node) + " is no map; change it in the text");
  const Entries entries = is_map ? yaml.entries(section->value) : Entries();
  const YamlEntryText* entry = find_entry(entries, edit.name);
  if (!edit.value) {
    if (!entry) return yaml.text();
    return entries.size() > 1 ? without_entry(yaml, section->value, edit.name) : without_entry(yaml, node, key);
  }
  if (entry) return with_value(yaml, *entry, *edit.value);
  if (!entries.empty()) return with_entry(yaml, section->value, edit.name, *edit.value);
  const std::string map = "{" + yaml_scalar(edit.name) + ": " + *edit.value + "}";
  return section ? with_value(yaml, *section, map) : with_entry(yaml, node, key, map);
}

/// `uses` and `may_fail`.
std::string edit_part(const YamlText& yaml, const YAML::Node& node, const PipelineEdit& edit) {
  const std::string key = edit.what == What::uses ? "uses" : "may_fail";
  const Entries parts = yaml.entries(node);
  const YamlEntryText* part = find_entry(parts, key);
  if (!edit.value) return part && parts.size() > 1 ? without_entry(yaml, node, key) : yaml.text();
  return part ? with_value(yaml, *part, *edit.value) : with_entry(yaml, node, key, *edit.value);
}

YAML::Node value_of(const PipelineEdit& edit) {
  if (edit.value->find_first_of("\r\n") != std::string::npos) throw Error(edit.key() + " needs a value on one line");
  try {
    const YAML::Node value = parse_yaml(*edit.value, {.aliases = false});
    if (!value.IsDefined() || value.IsNull()) throw Error(edit.key() + " needs a value on one line");
    return value;
  } catch (const YAML::Exception& fault) {
    throw Error(edit.key() + ": " + in_quotes(printable(*edit.value)) + " is no value: " + printable(fault.msg));
  }
}

bool drops_options(const YAML::Node& node, const PipelineEdit& edit) {
  return edit.what == What::uses && edit.value && node["with"] && node["uses"] && node["uses"].IsScalar() &&
         node["uses"].Scalar() != value_of(edit).Scalar();
}

/// The same change, made in a tree.
void apply(YAML::Node root, const PipelineEdit& edit) {
  YAML::Node node = node_of(root, edit.node);
  if (edit.what == What::uses || edit.what == What::may_fail) {
    if (drops_options(node, edit)) node.remove("with");
    const char* key = edit.what == What::uses ? "uses" : "may_fail";
    if (edit.value)
      node[key] = value_of(edit);
    else
      node.remove(key);
    return;
  }
  const std::string key = section_of(edit);
  if (edit.value) {
    if (!node[key] || !node[key].IsMap()) node[key] = YAML::Node(YAML::NodeType::Map);
    node[key][edit.name] = value_of(edit);
  } else if (node[key] && node[key].IsMap() && node[key][edit.name]) {
    node[key].remove(edit.name);
    if (node[key].size() == 0) node.remove(key);
  }
}

bool is_same(const YAML::Node& a, const YAML::Node& b) {
  if (a.Type() != b.Type() || a.size() != b.size()) return false;
  if (a.IsScalar()) return a.Scalar() == b.Scalar() && (a.Tag() == "!") == (b.Tag() == "!");
  for (auto one = a.begin(), other = b.begin(); one != a.end(); ++one, ++other) {
    if (a.IsSequence() ? !is_same(*one, *other)
                       : !is_same(one->first, other->first) || !is_same(one->second, other->second))
      return false;
  }
  return true;
}

}  // namespace

std::string PipelineEdit::key() const {
  switch (what) {
    case What::uses:
      return node + ".uses";
    case What::may_fail:
      return node + ".may_fail";
    case What::wire:
      return node + ".in." + name;
    case What::option:
      break;
  }
  return node + "." + name;
}

std::string PipelineEdit::in_words() const { return key() + (value ? " = " + *value : " removed"); }

std::string edited_text(const std::string& text, const PipelineEdit& edit) {
  if (edit.what == What::uses && !edit.value) throw Error("node " + in_quotes(edit.node) + " must use something");
  const YamlText yaml(text);
  const YAML::Node node = node_of(yaml.root(), edit.node);
  std::string result = edit.what == What::option || edit.what == What::wire ? edit_section(yaml, node, edit)
                                                                            : edit_part(yaml, node, edit);
  try {
    if (drops_options(node, edit)) {
      const YamlText changed(result);
      result = without_entry(changed, node_of(changed.root(), edit.node), "with");
    }
    YAML::Node wanted = parse_yaml(text, {.aliases = false});
    apply(wanted, edit);
    if (is_same(parse_yaml(result, {.aliases = false}), wanted)) return result;
  } catch (const YAML::Exception&) {  // ends in the Error below
  } catch (const Error&) {
    if (edit.value) value_of(edit);  // says what is wrong with it
  }
  throw Error(edit.key() +
              " cannot be changed here, because the file would then say something else; change it in the "
              "text");
}

std::string yaml_scalar(const std::string& text) {
  static const std::string kSpecial = ":#{}[],&*!|>'\"%@`\\\n\r\t";
  const bool is_edge = text.empty() || text.front() == ' ' || text.back() == ' ' || text.front() == '-' ||
                       text.front() == '?' || text.front() == '=' || text.front() == '<';
  if (!is_edge && text.find_first_of(kSpecial) == std::string::npos) {
    const YAML::Node plain(YAML::Load(text));
    static const std::vector<std::string> kWords{"true", "false", "yes", "no", "on", "off", "null", "~",
                                                 "True", "False", "Yes", "No", "On", "Off", "Null", "NULL",
                                                 "TRUE", "FALSE", "YES", "NO", "ON", "OFF", "y",    "n"};
    if (plain.IsScalar() && plain.Scalar() == text && !contains(kWords, text) && !yaml_number(plain)) return text;
  }
  return json_text(nlohmann::json(text));
}

}  // namespace marrow::workbench
