// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the requests about X-rays share: the files that pipelines read, and what is shown of a run.

#include "marrow/toolbox/files/camera_file.hpp"
#include "workbench/workbench.hpp"

namespace marrow::workbench {

/// The camera file of a view: the file that `camera` names by {file}, or a file in .marrow/drafts. The latter holds the
/// keys in `camera` itself, or the camera of another program's file if `camera` has the keys for that. Throws Error if
/// there is no camera, or if it cannot be read.
std::filesystem::path camera_file(const Workbench& workbench, const nlohmann::json& camera, const std::string& image);

/// The overrides that name these views, a list of {name, image, camera}, for the node `views` of a pipeline.
std::vector<Override> overrides_of(const Workbench& workbench, const nlohmann::json& views);

/// A run of a small pipeline or of a node, during the request: its outputs and its warnings.
struct Ran {
  std::map<std::string, Value> outputs;
  std::vector<std::string> warnings;
};
/// Each throws Error as outputs_of() does.
Ran run(const PipelineCall& call, const Workbench& workbench);
Ran run(const NodeCall& call, const Workbench& workbench);

/// Each function adds a part of the requests.
void add_xray_checks(Server& server, Workbench& workbench);
void add_xray_exchange(Server& server, Workbench& workbench);
void add_xray_export(Server& server, Workbench& workbench);

}  // namespace marrow::workbench
