// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "commands.hpp"
#include "difference/findings.hpp"

namespace marrow::cli {

int diff(const std::filesystem::path& before, const std::filesystem::path& now, bool as_json) {
  KnownValues values;
  const Findings findings = find_differences(read_run(before), read_run(now), values);
  if (as_json)
    std::printf("%s\n", json_of(findings).dump(1, ' ', false, nlohmann::json::error_handler_t::replace).c_str());
  else
    print(findings);
  return findings.identical() ? 0 : 1;
}

}  // namespace marrow::cli
