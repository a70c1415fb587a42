// SPDX-License-Identifier: Apache-2.0
// What Slicer shows for an input follows from the options that get its value. A pipeline that was read no longer says
// which these are, and an input may reach an option through parts and bodies. So the pipeline is read with values that
// are recognised in the options.
#include "parameters.hpp"

#include <set>

#include "marrow/base/number_text.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;

/// An option that gets the value of an input.
struct UseOfInput {
  const NodeInfo* node;
  const OptionInfo* option;
  bool is_below = false;  ///< it gets a file below the path
  bool has_usual_direction = true;
};

bool contains_text(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

bool is_default(const PipelineNode& node, const std::string& option) {
  for (std::size_t i = 0; i < node.options.size(); ++i)
    if (node.info.options[i].name == option) return node.options[i] == node.info.options[i].default_value;
  return true;
}

std::vector<std::string> texts_of(const OptionValue& value) {
  if (const auto* text = std::get_if<std::string>(&value)) return {*text};
  if (const auto* texts = std::get_if<std::vector<std::string>>(&value)) return *texts;
  return {};
}

std::vector<UseOfInput> uses_of_path(const Pipeline& pipeline, const std::string& path) {
  std::vector<UseOfInput> uses;
  for (const PipelineNode* node : called_nodes(pipeline))
    for (std::size_t i = 0; i < node->options.size(); ++i)
      for (const std::string& text : texts_of(node->options[i]))
        if (text.starts_with(path))
          uses.push_back({&node->info, &node->info.options[i], text.size() > path.size(), is_default(*node, "maps")});
  return uses;
}

/// The formats that an option's help names say what Slicer can give. A pose of the other direction than that of
/// Slicer's files must stay a file that the user names.
std::pair<std::string, std::string> tag_and_end(const UseOfInput& use, const std::string& help_of_input) {
  const std::string& help = use.option->help;
  if (use.is_below || help.starts_with("folder") || help_of_input.starts_with("folder")) return {"directory", ""};
  if (contains_text(help, ".mrk.json")) return {"pointfile", ".mrk.json"};
  if (contains_text(help, ".tfm") && use.has_usual_direction) return {"transform", ".tfm"};
  if (contains_text(help, ".vtp")) return {"geometry", ".vtp"};
  const bool reads_volume = use.node->kind() == "read" && use.node->outputs[0].type.id == "volume";
  if (reads_volume && use.option->type == OptionType::path) return {"image", ".nrrd"};
  return {"file", ""};
}

/// Fills tag and end of a path. If its uses differ, Slicer cannot make the file, and the user names one.
void trace_path(SlicerParameter& parameter, const Pipeline& traced, const std::string& path) {
  std::set<std::pair<std::string, std::string>> kinds;
  for (const UseOfInput& use : uses_of_path(traced, path)) kinds.insert(tag_and_end(use, parameter.help));
  if (kinds.empty()) kinds.insert({parameter.help.starts_with("folder") ? "directory" : "file", ""});
  const auto [tag, end] = kinds.size() == 1 ? *kinds.begin() : std::pair<std::string, std::string>{"file", ""};
  parameter.tag = tag;
  parameter.end = end;
  parameter.channel = "input";
  // What Slicer takes from its scene has no default that is a file.
  if (tag != "file" && tag != "directory") parameter.default_text.reset();
}

/// The choices of an option that follows the input: another choice as the input's value becomes the option's value.
std::vector<std::string> choices_of(const PipelineInput& input, const Pipeline& pipeline, const Catalogue& catalogue) {
  const std::vector<const PipelineNode*> nodes = called_nodes(pipeline);
  for (std::size_t n = 0; n < nodes.size(); ++n)
    for (std::size_t i = 0; i < nodes[n]->options.size(); ++i) {
      const std::vector<std::string>& choices = nodes[n]->info.options[i].choices;
      const auto other = std::find_if(choices.begin(), choices.end(),
                                      [&](const std::string& choice) { return choice != input.default_text; });
      if (other == choices.end() || texts_of(nodes[n]->options[i]) != std::vector{input.default_text}) continue;
      Diagnostics faults;
      const Pipeline changed = try_pipeline(pipeline.file, {{{input.name, *other}}, {}}, catalogue, faults);
      if (!faults.empty()) continue;
      const std::vector<const PipelineNode*> after = called_nodes(changed);
      if (after.size() == nodes.size() && i < after[n]->options.size() &&
          texts_of(after[n]->options[i]) == std::vector{*other})
        return choices;
    }
  return {};
}

/// Without an exponent: Slicer shows as many decimals as the default has after its point.
std::string plain_number(const std::string& text) {
  constexpr int kMostDecimals = 340;  // of the number that is closest to zero
  const std::optional<double> value = parsed_number(text);
  for (int decimals = 0; value && decimals <= kMostDecimals; ++decimals)
    if (std::string plain = fixed_number(*value, decimals); parsed_number(plain) == value) return plain;
  return text;
}

std::string value_tag(const std::string& type) {
  if (type == "number") return "double";
  return type == "text" ? "string" : type;  // integer, boolean
}

/// A text in XML. Control characters have no place there.
std::string xml_text(const std::string& text) {
  std::string result;
  for (const char c : text) switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += (unsigned char)c < 0x20 ? ' ' : c;
    }
  return result;
}

std::string xml_element(const std::string& name, const std::string& text) {
  return "<" + name + ">" + xml_text(text) + "</" + name + ">\n";
}

std::string xml_of(const SlicerParameter& one) {
  const std::string margin = "      ";
  std::string text = "    <" + one.tag;
  if (!one.end.empty()) text += " fileExtensions=\"" + xml_text(one.end) + "\"";
  text += ">\n" + margin + xml_element("name", one.name) + margin + xml_element("longflag", one.name);
  text += margin + xml_element("description", one.help) + margin + xml_element("label", one.label);
  if (one.default_text) text += margin + xml_element("default", *one.default_text);
  if (!one.channel.empty()) text += margin + xml_element("channel", one.channel);
  for (const std::string& choice : one.choices) text += margin + xml_element("element", choice);
  return text + "    </" + one.tag + ">\n";
}

std::string xml_group(const std::string& label, const std::string& help, const std::vector<SlicerParameter>& all) {
  if (all.empty()) return "";
  std::string text = "  <parameters>\n    " + xml_element("label", label) + "    " + xml_element("description", help);
  for (const SlicerParameter& one : all) text += xml_of(one);
  return text + "  </parameters>\n";
}

}  // namespace

std::string slicer_tag(const std::string& end) {
  static const std::map<std::string, std::string> kTags{
      {"", "directory"},    {".mha", "image"},    {".tfm", "transform"},      {".vtp", "geometry"},
      {".obj", "geometry"}, {".ply", "geometry"}, {".mrk.json", "pointfile"}, {".fcsv", "pointfile"}};
  const auto found = kTags.find(end);
  return found == kTags.end() ? "file" : found->second;
}

std::string slicer_name(const std::string& name) {
  std::string result;
  for (const char c : name) result += std::isalnum((unsigned char)c) && (unsigned char)c < 0x80 ? c : '_';
  return result;
}

std::vector<SlicerParameter> slicer_inputs(const Pipeline& pipeline, const Catalogue& catalogue) {
  const auto path_of = [](const std::string& name) { return "/marrow-export-slicer/" + name + "/"; };
  PipelineArguments arguments;
  for (const PipelineInput& input : pipeline.inputs)
    if (input.type == "path") arguments.inputs.push_back({input.name, path_of(input.name) + "x"});
  Diagnostics faults;
  Pipeline traced = try_pipeline(pipeline.file, arguments, catalogue, faults);
  if (!faults.empty()) traced = Pipeline();  // then no path is traced, and each is a file that the user names
  std::vector<SlicerParameter> parameters;
  for (const PipelineInput& input : pipeline.inputs) {
    SlicerParameter one{value_tag(input.type), slicer_name(input.name), input.name, input.help};
    if (input.has_default) one.default_text = input.default_text;
    if (input.type == "path") trace_path(one, traced, path_of(input.name) + "x");
    if (input.type == "number" && one.default_text) one.default_text = plain_number(*one.default_text);
    if (input.type == "text" && input.has_default) one.choices = choices_of(input, pipeline, catalogue);
    if (!one.choices.empty()) one.tag = "string-enumeration";
    parameters.push_back(std::move(one));
  }
  return parameters;
}

std::string slicer_description(const Pipeline& pipeline, const std::vector<SlicerParameter>& inputs,
                               const std::vector<SlicerParameter>& outputs) {
  return "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<executable>\n  " + xml_element("category", "marrow") + "  " +
         xml_element("title", pipeline.name) + "  " +
         xml_element("description", pipeline.help.substr(0, pipeline.help.find_last_not_of("\n") + 1)) + "  " +
         xml_element("version", MARROW_VERSION) + "  " + xml_element("documentation-url", "") + "  " +
         xml_element("license", "") + "  " + xml_element("contributor", "") +
         xml_group("Inputs", "What the pipeline is given.", inputs) +
         xml_group("Outputs", "What is computed: the results that get a place here, and no others.", outputs) +
         "</executable>\n";
}

}  // namespace marrow::cli
