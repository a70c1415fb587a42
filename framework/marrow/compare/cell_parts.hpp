// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the files of CellRunner share.
#include <nlohmann/json.hpp>
#include <string>

#include "marrow/compare/cell.hpp"
#include "marrow/runtime/run/verdicts.hpp"

namespace marrow::compare {

inline const std::string kChanged = "a file that the cell needs was changed while it ran; run it again";

/// The reason of the first node that failed, in the pipeline's order.
std::string reason_of(const Pipeline& pipeline, const RunResult& result);

/// Digest of the states of all files that the pipeline's needed nodes name. It changes if any of them is written to.
Digest states_of_files(const Pipeline& pipeline);

/// The poses among the outputs of a run, in the order of the pipeline's outputs.
std::vector<CellPose> poses_of(const Pipeline& pipeline, const RunResult& result,
                               const std::vector<NamedVerdict>& verdicts);
nlohmann::json poses_json(const std::vector<CellPose>& poses);
/// Throws an exception if the value is not what poses_json() made.
std::vector<CellPose> poses_from_json(const nlohmann::json& all);

}  // namespace marrow::compare
