// SPDX-License-Identifier: Apache-2.0
// The requests of the page "Pipeline".
#include "commands.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"
#include "workbench/pipeline.hpp"

namespace marrow::workbench {
namespace {

using nlohmann::json;

/// What the page keeps between requests. The handlers own it.
struct PipelinePage {
  explicit PipelinePage(Workbench& bench) : workbench(bench), files(bench.folder), kept_inputs(bench.folder) {}
  Workbench& workbench;
  PipelineFiles files;
  KeptInputs kept_inputs;
  LastRuns last_runs;
};
using Page = std::shared_ptr<PipelinePage>;

Answer described(const Page& page, json state) {
  describe_pipeline(state, page->workbench);
  state["command"] = command_of_form("check", state["file"], {}, page->workbench);
  state["kept_inputs"] = page->kept_inputs.of(state["file"]);
  return json_answer(state);
}

OptionType type_of_option(const std::string& uses, const std::string& name, const Catalogue& catalogue) {
  if (const NodeInfo* node = catalogue.find(uses))
    for (const OptionInfo& option : node->options)
      if (option.name == name) return option.type;
  return OptionType::number;  // an unknown option is a fault that the check reports
}

/// The edit that a form requests. People type texts and paths without quotes, so quotes are added where YAML needs
/// them.
PipelineEdit edit_of(const Request& request, const Catalogue& catalogue) {
  static const std::map<std::string, PipelineEdit::What> kWhat{{"option", PipelineEdit::What::option},
                                                               {"wire", PipelineEdit::What::wire},
                                                               {"uses", PipelineEdit::What::uses},
                                                               {"may_fail", PipelineEdit::What::may_fail}};
  PipelineEdit edit;
  const auto what = kWhat.find(request.text("what"));
  if (what == kWhat.end()) throw Error("no such edit: " + in_quotes(printable(request.text("what"))));
  edit.what = what->second;
  edit.node = request.text("node");
  edit.name = request.body.value("name", "");
  if (!request.body.contains("value") || request.body["value"].is_null()) return edit;
  edit.value = request.text("value");
  const bool is_list = edit.value->starts_with("[");
  if (edit.what == PipelineEdit::What::option) {
    const OptionType type = type_of_option(request.body.value("uses", ""), edit.name, catalogue);
    if (type == OptionType::text || type == OptionType::path) edit.value = yaml_scalar(*edit.value);
  } else if (edit.what == PipelineEdit::What::uses || (edit.what == PipelineEdit::What::wire && !is_list)) {
    edit.value = yaml_scalar(*edit.value);
  }
  return edit;
}

/// Throws Error if the edit would add faults to the file. Removing an option may add some; the page then shows them.
void expect_no_new_fault(const std::string& file, const PipelineEdit& edit, const Workbench& workbench) {
  if (!edit.value) return;
  const Place place{workbench.folder.inside(file).string(), 1,
                    1};  // paths in the value are relative to the file's folder
  const std::vector<std::string> before = faults_of(file, {}, workbench);
  std::string added;
  for (const std::string& fault : faults_of(file, {{edit.key(), *edit.value, place}}, workbench))
    if (!contains(before, fault)) added += (added.empty() ? "" : "\n") + fault;
  if (!added.empty()) throw Error(edit.in_words() + " is not written: " + added);
}

void add_file_requests(Server& server, const Page& page) {
  server.get("/api/pipeline",
             [page](const Request& request) { return described(page, page->files.open(request.parameter("file"))); });
  server.get("/api/pipeline/revision", [page](const Request& request) {
    return json_answer({{"revision", page->files.revision(request.parameter("file"))}});
  });
  server.post("/api/pipeline/text", [page](const Request& request) {
    const std::string text = request.text("text");
    return described(page, page->files.change(request.text("file"), request.text("revision"), "an edit of the text",
                                              [&](const std::string&) { return text; }));
  });
  server.post("/api/pipeline/edit", [page](const Request& request) {
    const std::string file = request.text("file");
    const PipelineEdit edit = edit_of(request, page->workbench.catalogue);
    const json state =
        page->files.change(file, request.text("revision"), edit.in_words(), [&](const std::string& text) {
          std::string edited = edited_text(text, edit);
          expect_no_new_fault(file, edit, page->workbench);
          return edited;
        });
    return described(page, state);
  });
  server.post("/api/pipeline/undo", [page](const Request& request) {
    return described(page, page->files.undo(request.text("file"), request.text("revision")));
  });
  server.post("/api/pipeline/redo", [page](const Request& request) {
    return described(page, page->files.redo(request.text("file"), request.text("revision")));
  });
  server.get("/api/pipeline/fits", [page](const Request& request) {
    Diagnostics diagnostics;
    const auto fits =
        nodes_in_place_of(request.parameter("node"), page->workbench.folder.inside(request.parameter("file")), {},
                          page->workbench.catalogue, diagnostics);
    if (!diagnostics.empty()) throw Error(diagnostics.text());
    json all = json::array();
    for (const Fit& fit : fits) {
      all.push_back(cli::fit_json(fit));
      all.back()["summary"] = page->workbench.catalogue.find(fit.node)->summary;
    }
    return json_answer(all);
  });
}

/// What the page offers before a file is open, and while its text is typed.
void add_offers(Server& server, const Page& page) {
  server.get("/api/pipeline/own", [](const Request&) { return json_answer(own_pipelines()); });
  server.post("/api/pipeline/copy", [page](const Request& request) {
    return json_answer({{"file", copy_of_own_pipeline(request.text("name"), page->workbench.folder)}});
  });
  server.get("/api/pipeline/words", [page](const Request&) {
    json nodes = json::array();
    for (const std::string& name : page->workbench.catalogue.node_names())
      nodes.push_back(cli::node_json(*page->workbench.catalogue.find(name)));
    return json_answer(nodes);
  });
}

json inputs_of(const Request& request) { return request.body.value("inputs", json::object()); }

void add_run_requests(Server& server, const Page& page) {
  server.post("/api/pipeline/plan", [page](const Request& request) {
    const std::string file = request.text("file");
    json plan = plan_of(pipeline_of_form(file, inputs_of(request), page->workbench), page->workbench);
    page->kept_inputs.keep(file, inputs_of(request));
    plan["command"] = command_of_form("plan", file, inputs_of(request), page->workbench);
    plan["run_command"] = command_of_form("run", file, inputs_of(request), page->workbench);
    return json_answer(plan);
  });
  server.post("/api/pipeline/run", [page](const Request& request) {
    const std::string file = request.text("file"),
                      command = command_of_form("run", file, inputs_of(request), page->workbench);
    const auto run = std::make_shared<LastRun>();
    run->revision = page->files.revision(file);
    run->inputs = inputs_of(request);
    run->pipeline = pipeline_of_form(file, run->inputs, page->workbench);
    const PipelineArguments arguments = arguments_of_form(file, run->inputs, page->workbench);
    const std::string job =
        page->workbench.jobs.start("Run " + run->pipeline.name, command, [page, run, file, arguments](Job& it) {
          json result = run_into_folder(run, arguments, page->workbench, it);
          page->last_runs.keep(file, run);
          return result;
        });
    return json_answer({{"job", job}, {"command", command}});
  });
  server.post("/api/pipeline/look", [page](const Request& request) {
    const std::string file = request.text("file"), node = request.text("node");
    const json inputs = inputs_of(request);
    const auto last = page->last_runs.find(file, page->files.revision(file), inputs);
    const auto pipeline =
        std::make_shared<Pipeline>(last ? last->pipeline : pipeline_of_form(file, inputs, page->workbench));
    const std::string job = page->workbench.jobs.start("Look at " + node, "", [page, pipeline, last, node](Job& it) {
      return outputs_of_node(*pipeline, node, last.get(), page->workbench, it);
    });
    return json_answer({{"job", job}});
  });
}

}  // namespace

void add_pipeline_page(Server& server, Workbench& workbench) {
  const auto page = std::make_shared<PipelinePage>(workbench);
  add_offers(server, page);
  add_file_requests(server, page);
  add_run_requests(server, page);
}

}  // namespace marrow::workbench
