// SPDX-License-Identifier: Apache-2.0
// The profile of a run as its page draws it. data.js in tools/report/page describes the result.
#include <algorithm>

#include "marrow/base/error.hpp"
#include "marrow/base/json_text.hpp"
#include "marrow/base/text_file.hpp"
#include "report/report.hpp"
#include "run_files.hpp"

namespace marrow::cli {
namespace {

using nlohmann::json;

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

}  // namespace

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

}  // namespace marrow::cli
