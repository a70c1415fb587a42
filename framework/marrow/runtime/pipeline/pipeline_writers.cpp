// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/pipeline/pipeline_writers.hpp"

namespace marrow {

std::string no_writer(const TypeInfo& type) { return "no plugin writes values of type '" + type.id + "'"; }

void check_writers(const Pipeline& pipeline, const Catalogue& catalogue, Diagnostics& diagnostics) {
  for (const PipelineOutput& output : pipeline.outputs) {
    if (output.source.node < 0) continue;  // it names nothing that is there; this was already reported
    const PipelineNode& node = pipeline.nodes[std::size_t(output.source.node)];
    const TypeInfo& type = node.info.outputs[std::size_t(output.source.output)].type;
    if (catalogue.find_writer(type) || pipeline.only_inside) continue;
    if (type.is_function)
      diagnostics.add(output.source.place,
                      "output '" + output.name + "' is a function (" + type.id + "), which no file can hold",
                      "leave it out; or, if no command runs the pipeline but only the program itself, say  "
                      "only_inside: true");
    else
      diagnostics.add(output.source.place, "output '" + output.name + "': " + no_writer(type),
                      "leave it out, or name a result of another type");
  }
}

}  // namespace marrow
