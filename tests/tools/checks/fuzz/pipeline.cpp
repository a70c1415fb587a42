// SPDX-License-Identifier: Apache-2.0
// Pipelines. Behind the first zero byte are the arguments of the command line: key=value, one a line.
#include "marrow/runtime/pipeline/pipeline.hpp"
#include "nodes.hpp"

namespace {

using namespace marrow;

PipelineArguments arguments_of(std::string_view lines) {
  PipelineArguments arguments;
  while (!lines.empty()) {
    const std::string line(lines.substr(0, lines.find('\n')));
    lines.remove_prefix(std::min(lines.size(), line.size() + 1));
    const std::size_t equals = line.find('=');
    if (equals == std::string::npos || equals == 0) continue;
    const std::string key = line.substr(0, equals), value = line.substr(equals + 1);
    if (key.find('.') == std::string::npos)
      arguments.inputs.push_back({key, value});
    else
      arguments.overrides.push_back({key, value});
  }
  return arguments;
}

/// Checks the promise of resolved_yaml(): reading its text gives the same pipeline.
void expect_same_again(const Pipeline& pipeline) {
  const std::string once = resolved_yaml(pipeline);
  Diagnostics faults;
  const Pipeline again = read_pipeline(fuzz::put("resolved.yaml", once), {}, fuzz::nodes(), faults);
  if (!faults.empty()) fuzz::finding("the resolved pipeline has faults:\n" + faults.text() + once);
  if (const std::string twice = resolved_yaml(again); twice != once)
    fuzz::finding("the resolved pipeline is read as another one:\n" + once + "---\n" + twice);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  const std::filesystem::path file = fuzz::put("a.yaml", input.text());
  const PipelineArguments arguments = arguments_of(input.rest);
  fuzz::expect_value_or_error([&] {
    Diagnostics faults;
    const Pipeline pipeline = read_pipeline(file, arguments, fuzz::nodes(), faults);
    if (faults.empty())
      expect_same_again(pipeline);
    else
      faults.text();
  });
  return 0;
}
