// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the page "Pipeline" shows of a file, and the file's pipeline with the page's inputs.
#include <nlohmann/json.hpp>
#include <string>

#include "workbench/workbench.hpp"

namespace marrow::workbench {

/// Adds to {file, text} what the file says: {faults: [{file, line, column, message, hint}], faults_text, inputs, graph,
/// nodes, outputs}. With faults, `graph` is null and `nodes` says only what is written.
void describe_pipeline(nlohmann::json& state, const Workbench& workbench);

/// The arguments that the page's form gives: {name: text}. Texts of inputs of type path are relative to the opened
/// folder; an empty text counts as not given. Throws Error for a path that leads out of the folder.
PipelineArguments arguments_of_form(const std::string& file, const nlohmann::json& inputs, const Workbench& workbench);

/// A pipeline that can be run, with these inputs. Throws Error with all faults.
Pipeline pipeline_of_form(const std::string& file, const nlohmann::json& inputs, const Workbench& workbench);

/// "cd FOLDER && marrow run FILE name=value".
std::string command_of_form(const std::string& command, const std::string& file, const nlohmann::json& inputs,
                            const Workbench& workbench);

/// The faults of the file with these overrides, each with its hint.
std::vector<std::string> faults_of(const std::string& file, const std::vector<Override>& overrides,
                                   const Workbench& workbench);

}  // namespace marrow::workbench
