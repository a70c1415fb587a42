// SPDX-License-Identifier: Apache-2.0
// `marrow export slicer`: a pipeline as a command-line module of 3D Slicer. The module is a program with a description
// and a pipeline beside it. This pipeline extends the exported one by nodes that write files as Slicer reads them.
#include <yaml-cpp/yaml.h>

#include <cstdio>
#include <nlohmann/json.hpp>
#include <set>

#include "../command_options.hpp"
#include "../new/templates.hpp"
#include "../process.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/text_file.hpp"
#include "parameters.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// The node that gives a value as a file of Slicer.
struct SlicerWriter {
  std::string type, node, port, end;
};
const std::vector<SlicerWriter> kSlicerWriters{{"pose", "write.tfm", "pose", ".tfm"},
                                               {"mesh", "write.vtp", "mesh", ".vtp"},
                                               {"landmarks", "write.markups", "landmarks", ".mrk.json"},
                                               {"seeds", "write.markups", "seeds", ".mrk.json"}};

const SlicerWriter* slicer_writer(const std::string& type, const Catalogue& catalogue) {
  for (const SlicerWriter& one : kSlicerWriters)
    if (one.type == type && catalogue.find(one.node)) return &one;
  return nullptr;
}

/// An output of the pipeline as the module gives it.
struct SlicerOutput {
  SlicerParameter parameter;
  std::string name;  ///< in the exported pipeline
  std::string source;
  const SlicerWriter* writer;  ///< null: the file that marrow writes anyway
  bool may_be_absent;          ///< so the writer need not be called
  std::vector<std::string> axes;
  std::vector<std::string> nodes;  ///< ids of the nodes that a run of this output alone calls

  /// The output of the module's pipeline that has the file.
  std::string in_module() const { return writer ? "slicer_" + name : name; }
};

SlicerOutput output_of(const PipelineOutput& output, const Pipeline& pipeline, const Catalogue& catalogue) {
  const PortInfo& port = pipeline.output_of(output.source);
  SlicerOutput result{{}, output.name, output.source.text, slicer_writer(port.type.id, catalogue), false, {}, {}};
  const PipelineNode& node = pipeline.node_of(output.source);
  result.may_be_absent = node.may_fail || port.optional || node.repetition;
  result.axes = pipeline.axes_of(output.source);
  SlicerParameter& parameter = result.parameter;
  parameter.end = result.writer ? result.writer->end : catalogue.find_writer(port.type)->extension;
  parameter.tag = slicer_tag(parameter.end);
  parameter.name = "output_" + slicer_name(output.name);
  parameter.label = output.name;
  parameter.help = port.help;
  parameter.channel = "output";
  Pipeline alone = pipeline;
  keep_outputs(alone, {output.name});
  const std::vector<bool> needed = alone.needed();
  for (std::size_t i = 0; i < needed.size(); ++i)
    if (needed[i]) result.nodes.push_back(alone.nodes[i].id);
  if (result.writer) result.nodes.push_back(result.in_module());
  return result;
}

/// What is exported: the description, and what the program must know besides.
struct SlicerModule {
  std::vector<SlicerParameter> inputs, outputs;
  std::vector<SlicerOutput> results;
  json input_names = json::object(), items = json::object();

  SlicerModule(const Pipeline& pipeline, const Catalogue& catalogue) : inputs(slicer_inputs(pipeline, catalogue)) {
    for (std::size_t i = 0; i < inputs.size(); ++i) input_names[inputs[i].name] = pipeline.inputs[i].name;
    for (const PipelineOutput& output : pipeline.outputs) {
      results.push_back(output_of(output, pipeline, catalogue));
      outputs.push_back(results.back().parameter);
    }
    for (const SlicerOutput& result : results)
      for (const std::string& axis : result.axes) add_item(axis);
    outputs.push_back({"directory", "run_folder", "run folder",
                       "a new or empty folder for the whole run, with all results and the log; none: only the results "
                       "that get a place here are computed",
                       std::nullopt, "output"});
    expect_distinct(pipeline);
  }

  void add_item(const std::string& axis) {
    const std::string name = "item_" + slicer_name(axis);
    if (items.contains(axis)) return;
    items[axis] = name;
    outputs.push_back(
        {"string", name, axis, "the " + axis + " whose results are taken; it need not be named if there is only one"});
  }

  void expect_distinct(const Pipeline& pipeline) const {
    std::set<std::string> names;
    for (const std::vector<SlicerParameter>* list : {&inputs, &outputs})
      for (const SlicerParameter& one : *list)
        if (!names.insert(one.name).second)
          throw Error(printable(pipeline.file.string()) + ": two inputs or outputs would be the parameter '" +
                      one.name + "' of the module; rename one of them");
    for (const SlicerOutput& result : results) {
      const std::string added = result.in_module();
      const auto is_taken = [&](const auto& one) { return one == added; };
      if (!result.writer) continue;
      for (const PipelineNode& node : pipeline.nodes)
        if (is_taken(node.id))
          throw Error(printable(pipeline.file.string()) + ": the module adds a node '" + added +
                      "', and the pipeline has one already; rename it");
      for (const PipelineOutput& output : pipeline.outputs)
        if (is_taken(output.name))
          throw Error(printable(pipeline.file.string()) + ": the module adds an output '" + added +
                      "', and the pipeline has one already; rename it");
    }
  }

  json outputs_json() const {
    json all = json::object();
    for (const SlicerOutput& result : results) {
      json only = json::array({result.name});
      if (result.writer) only.push_back(result.in_module());
      all[result.parameter.name] = {{"run", result.in_module()},
                                    {"end", result.parameter.end},
                                    {"axes", result.axes},
                                    {"only", only},
                                    {"nodes", result.nodes}};
    }
    return all;
  }

  /// The pipeline that the program runs.
  std::string pipeline_text(const Pipeline& exported, const std::string& name) const {
    YAML::Emitter out;
    out << YAML::BeginMap << YAML::Key << "marrow" << YAML::Value << 1 << YAML::Key << "name" << YAML::Value << name
        << YAML::Key << "extends" << YAML::Value << fs::absolute(exported.file).string() << YAML::Key << "nodes"
        << YAML::Value << YAML::BeginMap;
    for (const SlicerOutput& result : results) {
      if (!result.writer) continue;
      out << YAML::Key << result.in_module() << YAML::Value << YAML::Flow << YAML::BeginMap << YAML::Key << "uses"
          << YAML::Value << result.writer->node << YAML::Key << "in" << YAML::Value << YAML::BeginMap << YAML::Key
          << result.writer->port << YAML::Value << result.source << YAML::EndMap;
      if (result.may_be_absent) out << YAML::Key << "may_fail" << YAML::Value << true;
      out << YAML::EndMap;
    }
    out << YAML::EndMap << YAML::Key << "outputs" << YAML::Value << YAML::BeginMap;
    for (const SlicerOutput& result : results)
      if (result.writer) out << YAML::Key << result.in_module() << YAML::Value << result.in_module();
    out << YAML::EndMap << YAML::EndMap;
    return "# Run by the module beside it; made by: marrow export slicer\n" + std::string(out.c_str()) + "\n";
  }
};

int export_slicer(const fs::path& file, const fs::path& folder) {
  const Catalogue catalogue;
  Pipeline pipeline;
  if (!load({file, {}, {}}, catalogue, pipeline, false)) return 2;
  expect_files_can_hold(pipeline, catalogue);
  for (const PipelineInput& input : pipeline.inputs)
    if (input.is_data)
      throw Error(printable(file.string()) + ": its input '" + input.name + "' is data of type " + input.type +
                  ", which only another pipeline can give; export the pipeline that uses this one");
  const SlicerModule module(pipeline, catalogue);
  const std::string name = slicer_name(pipeline.name);
  const fs::path program = folder / name, description = folder / (name + ".xml"), run = folder / (name + ".yaml");
  for (const fs::path& place : {program, description, run}) expect_free(place);
  fs::create_directories(folder);
  const std::string text = read_text_file(shared_files("templates/slicer/module"), kMostSourceBytes);
  write_text_file(run, module.pipeline_text(pipeline, name));
  write_text_file(description, slicer_description(pipeline, module.inputs, module.outputs));
  write_text_file(program,
                  replaced(text, {{"@program@", json(this_program().string()).dump()},
                                  {"@inputs@", module.input_names.dump()},
                                  {"@outputs@", module.outputs_json().dump()},
                                  {"@items@", module.items.dump()}}),
                  Kinds::files, 0777);
  std::printf("made %s\nname its folder in 3D Slicer: Edit, Application Settings, Modules, Additional module paths\n",
              printable(program.string()).c_str());
  return 0;
}

}  // namespace

void add_export(CLI::App& app, int& code) {
  struct Given {
    fs::path pipeline, out;
  };
  const auto given = std::make_shared<Given>();
  CLI::App* command = app.add_subcommand("export", "make a program of a pipeline for other software");
  command->require_subcommand(1);
  CLI::App* slicer = command->add_subcommand("slicer", "a command-line module of 3D Slicer");
  slicer->add_option("pipeline", given->pipeline, "pipeline file (YAML)")->required();
  slicer->add_option("--out", given->out, "the folder for the module's three files; others may be there")->required();
  slicer->callback([given, &code] { code = export_slicer(given->pipeline, given->out); });
  say_that_libraries_are_described(slicer);
}

}  // namespace marrow::cli
