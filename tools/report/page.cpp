// SPDX-License-Identifier: Apache-2.0
#include <webp/encode.h>
#include <algorithm>

#include "commands.hpp"
#include "difference/difference.hpp"
#include "marrow/base/json_text.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/plain_text.hpp"
#include "marrow/base/printable.hpp"
#include "report/report.hpp"
#include "run_files.hpp"

// The page without its data. tools/report/page/bundle.py makes it when marrow is built.
asm(".section .rodata\n"
    ".global marrow_report_page\n"
    ".global marrow_report_page_end\n"
    "marrow_report_page:\n"
    ".incbin \"" MARROW_REPORT_PAGE
    "\"\n"
    "marrow_report_page_end:\n"
    ".byte 0\n"
    ".previous\n");
extern "C" const char marrow_report_page[], marrow_report_page_end[];

namespace marrow::cli {
namespace {

using nlohmann::json;

/// How a body runs, as options of the node.
std::map<std::string, std::string> options_of_repetition(const Repetition& repetition) {
  std::map<std::string, std::string> options{{"passes", passes_text(repetition)},
                                             {"if_pass_fails", repetition.goes_on ? "go_on" : "end"}};
  for (const Repetition::Given& given : repetition.given)
    if (given.carried >= 0) options["carry " + given.name] = repetition.alone.outputs[std::size_t(given.carried)].name;
  return options;
}

std::map<std::string, std::string> options_of(const PipelineNode& node) {
  if (node.repetition) return options_of_repetition(*node.repetition);
  std::map<std::string, std::string> options;
  for (std::size_t i = 0; i < node.options.size(); ++i) options[node.info.options[i].name] = yaml_text(node.options[i]);
  return options;
}

/// Options whose values are not the defaults.
json given_options(const PipelineNode& node) {
  if (node.repetition) return options_of_repetition(*node.repetition);
  json given = json::object();
  for (std::size_t i = 0; i < node.options.size(); ++i) {
    const OptionInfo& option = node.info.options[i];
    if (option.required || node.options[i] != option.default_value) given[option.name] = yaml_text(node.options[i]);
  }
  return given;
}

std::string wires_of(const PipelineNode& node) {
  std::string text;
  for (const Wire& wire : node.wires) {
    text += node.input_of(wire).name + ":";
    for (const Reference& source : wire.sources) text += " " + source.text;
    text += "\n";
  }
  return text;
}

/// The difference of two nodes, for example "uses KIND.NAME; high = 80". Empty if they are the same.
std::string difference(const PipelineNode& base, const PipelineNode& other) {
  std::string text;
  const auto add = [&](const std::string& what) { text += (text.empty() ? "" : "; ") + what; };
  if (base.info.name != other.info.name) add("uses " + other.info.name);
  const auto before = options_of(base);
  for (const auto& [name, value] : options_of(other)) {
    const auto found = before.find(name);
    if (found == before.end() ? base.info.name == other.info.name : found->second != value) add(name + " = " + value);
  }
  if (wires_of(base) != wires_of(other)) add("other inputs");
  if (base.may_fail != other.may_fail) add(other.may_fail ? "may fail" : "may not fail");
  return text;
}

/// With more bars a browser takes long to draw. The longest ones are shown.
constexpr std::size_t kMostBarsOfPage = 20'000;

struct DrawnBar {
  std::size_t row, name;
  double begin_us, length_us, thread_us;
};

/// The numbers of texts, in the order of their first use.
class Numbered {
 public:
  std::size_t of(const json& text) {
    const auto [at, is_new] = number_.try_emplace(text.dump(), all_.size());
    if (is_new) all_.push_back(text);
    return at->second;
  }
  const json& all() const { return all_; }

 private:
  std::map<std::string, std::size_t> number_;
  json all_ = json::array();
};

json drawn(const json& profile) {
  std::vector<DrawnBar> bars;
  Numbered rows, names;
  std::map<std::int64_t, std::string> row_names;
  json busy = json::array();
  for (const json& event : profile.at("traceEvents")) {
    const std::string phase = event.at("ph");
    const auto row = [&] { return row_names.at(event.at("tid").get<std::int64_t>()); };
    if (phase == "M" && event.at("name") == "thread_name")
      row_names[event.at("tid").get<std::int64_t>()] = event.at("args").at("name");
    else if (phase == "C")
      busy.push_back({event.at("ts").get<double>(), event.at("args")});
    else if (phase == "X")
      bars.push_back({rows.of(row()),
                      names.of({{"title", event.at("name").get<std::string>()},
                                {"kind", event.at("cat").get<std::string>()},
                                {"node", event.at("args").at("node").get<std::string>()}}),
                      event.at("ts").get<double>(), event.at("dur").get<double>(), event.value("tdur", -1.0)});
  }
  const std::size_t shown = std::min(bars.size(), kMostBarsOfPage);
  const auto is_longer = [](const DrawnBar& a, const DrawnBar& b) { return a.length_us > b.length_us; };
  std::nth_element(bars.begin(), bars.begin() + std::ptrdiff_t(shown), bars.end(), is_longer);
  const std::size_t hidden = bars.size() - shown;
  bars.resize(shown);
  std::sort(bars.begin(), bars.end(), [](const DrawnBar& a, const DrawnBar& b) {
    return std::tuple(a.row, a.begin_us, -a.length_us) < std::tuple(b.row, b.begin_us, -b.length_us);
  });
  json list = json::array();
  for (const DrawnBar& bar : bars) list.push_back({bar.row, bar.name, bar.begin_us, bar.length_us, bar.thread_us});
  const json& own = profile.at("marrow");
  return {{"us", own.at("us").get<double>()},
          {"rows", rows.all()},
          {"names", names.all()},
          {"bars", list},
          {"busy", busy},
          {"sums", own.at("sums")},
          {"left_out", own.at("left_out").get<std::size_t>() + hidden}};
}

constexpr std::string_view kBegin = "<script type=\"application/json\" id=\"recipes\">", kEnd = "</script>";

constexpr std::string_view kMarker = "<!-- marrow:data -->", kBefore = "<script type=\"application/json\" id=\"data\">",
                           kAfter = "</script>";

std::string_view page_without_data() {
  return {marrow_report_page, std::size_t(marrow_report_page_end - marrow_report_page)};
}

/// $'...', which keeps any bytes in one line of characters that a terminal shows as they are.
std::string escaped_word(const std::string& text) {
  std::string word = "$'";
  for (const char c : text) {
    const bool is_plain = c >= ' ' && c <= '~' && c != '\'' && c != '\\' && c != '!';  // ! recalls commands in bash
    word += is_plain ? std::string(1, c) : formatted("\\{:03o}", static_cast<unsigned char>(c));
  }
  return word + "'";
}

/// The text of JSON data inside of a script element. No text in the data may end the script, so "<" is written as a
/// JSON escape.
std::string text_in_page(const nlohmann::json& data) {
  const std::string text = json_text(data);
  std::string safe;
  safe.reserve(text.size() + text.size() / 16);
  for (const char c : text) c == '<' ? safe += "\\u003c" : safe += c;
  return safe;
}

}  // namespace

json graph_of(const Pipeline& pipeline, const std::vector<std::pair<std::string, Pipeline>>& variants) {
  json nodes = json::array(), edges = json::array();
  const DrawnGraph graph = drawn_graph(pipeline, true);
  std::vector<std::pair<std::string, DrawnGraph>> others;
  for (const auto& [name, other] : variants) others.emplace_back(name, drawn_graph(other, false));
  for (const auto& [id, body, node, is_needed] : graph.nodes) {
    json differs = json::object();
    for (const auto& [name, other] : others)
      for (const DrawnNode& same : other.nodes)
        if (same.id == id) {
          const std::string text = difference(*node, *same.node);
          if (!text.empty()) differs[name] = text;
        }
    nodes.push_back({{"id", id}, {"uses", node->info.name}, {"options", given_options(*node)}, {"differs", differs}});
  }
  for (const DrawnEdge& edge : graph.edges)
    if (!edge.is_of_pass_before) edges.push_back({{"from", edge.from}, {"to", edge.to}, {"port", edge.port}});
  return {{"nodes", nodes}, {"edges", edges}};
}

json profile_of(const std::filesystem::path& folder, std::vector<std::string>& left_out) {
  const auto file = file_of_run(folder, "profile.json");
  if (!file) return {};
  try {
    return drawn(parse_json(read_text_file(*file, kMostRecordBytes), "profile.json"));
  } catch (const std::exception&) {
    left_out.push_back(file->string() + " is not shown: it is not what 'marrow run --profile' wrote");
    return {};
  }
}

std::string recipe_of_folder(const std::filesystem::path& folder) {
  const RunRecord run = read_run(folder);
  refuse_outside(folder, "pipeline.yaml");
  const std::string pipeline = read_text_file(folder / "pipeline.yaml", kMostSourceBytes);
  return RunRecipe{run.version, run.seed, run.file_limits, pipeline}.text();
}

std::string recipes_element(const std::vector<NamedRecipe>& recipes) {
  json list = json::array();
  for (const NamedRecipe& one : recipes) list.push_back({{"name", one.name}, {"recipe", one.text}});
  return std::string(kBegin) + text_in_page(list) + std::string(kEnd) + "\n";
}

std::vector<NamedRecipe> recipes_in_page(std::string_view page) {
  const std::size_t begin = page.find(kBegin);
  if (begin == page.npos) return {};
  std::string_view element = page.substr(begin + kBegin.size());
  element = element.substr(0, element.find(kEnd));
  std::vector<NamedRecipe> recipes;
  try {
    for (const json& one : parse_json(std::string(element), "the list of recipes"))
      recipes.push_back({one.at("name"), one.at("recipe")});
  } catch (const std::exception&) {
    throw Error("its recipe is damaged");
  }
  return recipes;
}

// The profile of a run as its page draws it. data.js in tools/report/page describes the result.

std::size_t page_bytes(const nlohmann::json& data) {
  return page_without_data().size() - kMarker.size() + kBefore.size() + text_in_page(data).size() + kAfter.size();
}

void write_page(const nlohmann::json& data, const std::vector<NamedRecipe>& recipes, const std::filesystem::path& file,
                Kinds kinds) {
  const std::string_view page = page_without_data();
  const std::size_t at = page.find(kMarker);
  std::string text(page.substr(0, at));
  text.append(recipes_element(recipes));  // first, so that it is found quickly
  text.append(kBefore).append(text_in_page(data)).append(kAfter).append(page.substr(at + kMarker.size()));
  write_text_file(file, text, kinds);
}

std::string picture_url(const std::filesystem::path& png_file, int size_px) {
  const RgbPixels pixels = read_png(png_file);
  WebPConfig config;
  WebPPicture picture;
  WebPConfigInit(&config);
  WebPPictureInit(&picture);
  config.quality = 85;
  config.method = 2;  // thin lines stay sharp enough, and this is four times faster than the default
  picture.width = pixels.width_px;
  picture.height = pixels.height_px;
  WebPMemoryWriter writer;
  WebPMemoryWriterInit(&writer);
  picture.writer = WebPMemoryWrite;
  picture.custom_ptr = &writer;
  const double scale = double(size_px) / std::max(picture.width, picture.height);
  bool good = WebPPictureImportRGB(&picture, pixels.bytes.data(), 3 * picture.width);
  if (good && scale < 1)
    good =
        WebPPictureRescale(&picture, std::max(1, int(scale * picture.width)), std::max(1, int(scale * picture.height)));
  good = good && WebPEncode(&config, &picture);
  std::string url;
  if (good) url = "data:image/webp;base64," + base64({reinterpret_cast<const char*>(writer.mem), writer.size});
  WebPPictureFree(&picture);
  WebPMemoryWriterClear(&writer);
  if (!good) throw Error(png_file.string() + ": cannot be encoded as WebP");
  return url;
}

std::string shell_word(const std::string& text) {
  static const std::string kPlain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_@%+:,./-";
  if (!text.empty() && text.find_first_not_of(kPlain) == std::string::npos) return text;
  return printable(text) == text ? script_word(text) : escaped_word(text);
}

std::string shell_path(const std::filesystem::path& path) {
  return shell_word(path.native().starts_with("-") ? "./" + path.string() : path.string());
}

std::string script_word(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? "'\\''" : std::string(1, c);
  return quoted + "'";
}

}  // namespace marrow::cli
