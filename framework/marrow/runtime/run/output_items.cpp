// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/run/output_items.hpp"

#include "marrow/base/error.hpp"

namespace marrow {
namespace {

using Use = std::function<void(const std::string&, const Value&)>;

void visit(const Value& value, const std::string& item, const Use& use) {
  for (std::size_t i = 0; i < value.items.size(); ++i)
    visit(value.items[i], (item.empty() ? "" : item + "/") + value.names[i], use);
  if (!value.is_list() && !value.is_absent()) use(item, value);
}

}  // namespace

void for_each_item(const Pipeline& pipeline, const RunResult& result, const TypeInfo& type,
                   const std::function<void(const std::string&, const std::string&, const Value&)>& use) {
  for (const PipelineOutput& output : pipeline.outputs) {
    if (pipeline.output_of(output.source).type != type) continue;
    try {
      visit(value_of(result, output.source), "",
            [&](const std::string& item, const Value& value) { use(output.name, item, value); });
    } catch (const Error&) {  // the list does not have this item: the output's own fault says so
    }
  }
}

}  // namespace marrow
