// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "command_options.hpp"
#include "commands.hpp"
#include "difference/findings.hpp"

namespace marrow::cli {
namespace {

int diff(const std::filesystem::path& before, const std::filesystem::path& now, bool as_json) {
  KnownValues values;
  const Findings findings = find_differences(read_run(before), read_run(now), values);
  if (as_json)
    std::printf("%s\n", json_of(findings).dump(1, ' ', false, nlohmann::json::error_handler_t::replace).c_str());
  else
    print(findings);
  return findings.identical() ? 0 : 1;
}

}  // namespace

void add_diff(CLI::App& app, int& code) {
  struct Given {
    std::filesystem::path first, second;
    bool as_json = false;
  };
  const auto given = std::make_shared<Given>();
  CLI::App* command = app.add_subcommand("diff", "say where two runs part, by how much and why");
  command->add_option("first", given->first, "folder of a run, or of a cell of a comparison")->required();
  command->add_option("second", given->second, "folder of the run to compare it with")->required();
  command->add_flag("--json", given->as_json, "as JSON");
  command->callback([given, &code] { code = diff(given->first, given->second, given->as_json); });
}

}  // namespace marrow::cli
