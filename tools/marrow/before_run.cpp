// SPDX-License-Identifier: Apache-2.0
// What must hold before a run begins, so that nothing is found at its end.
#include "commands.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/run/place_of_results.hpp"
#include "marrow/runtime/store/shared_store.hpp"

namespace marrow::cli {

void expect_files_can_hold(const Pipeline& pipeline, const Catalogue& catalogue) {
  for (const PipelineOutput& output : pipeline.outputs) {
    const TypeInfo& type = pipeline.output_of(output.source).type;
    if (!catalogue.find_writer(type))
      throw Error(printable(pipeline.file.string()) + ": output '" + output.name + "' is " +
                  (type.is_function ? "a function" : "of the type " + std::string(type.id)) +
                  ", which no file can hold; the program itself runs this pipeline (only_inside): name other outputs "
                  "with --only");
  }
}

void expect_good_place(const Pipeline& pipeline, const std::filesystem::path& folder, const Store* store) {
  expect_nothing_reads(pipeline, folder.empty() ? "runs" : folder, "the output folder", "choose another with --out");
  if (store && store->fault().empty())
    expect_nothing_reads(pipeline, store->folder(), "the store of results",
                         "set MARROW_CACHE to another folder, or give --no-cache");
  if (store && store->shared())
    expect_nothing_reads(pipeline, store->shared()->folder(), "the shared store of results",
                         "set MARROW_SHARED_CACHE to another folder, or give --no-cache");
}

}  // namespace marrow::cli
