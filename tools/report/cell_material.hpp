// SPDX-License-Identifier: Apache-2.0
#pragma once
// The single cells on a comparison's page: a row for each, and pictures, curves and 3D views of some. The page holds as
// many of these as its size allows; the others are beside it, in the folder report/.
#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "report/report.hpp"

namespace marrow::cli {

/// All cells, as data.js describes a cell_table.
nlohmann::json cell_table(const compare::Experiment& experiment, const std::vector<compare::CellRow>& rows);

/// Enters the materials of the cells in `shown` into `data`, in this order, as long as the page has at most
/// `most_bytes`. Those of a case and start stay together. The others become files of FOLDER/report, which `data` lists
/// as parts. A file is named after its content. It holds a script, because a page from disk may load nothing else.
/// Besides the page, only one case and start is in memory at a time. Throws Error if a file cannot be written.
void add_cell_materials(nlohmann::json& data, const compare::CellRunner& runner,
                        const std::vector<compare::CellIndex>& shown, const std::filesystem::path& folder,
                        std::size_t most_bytes);

/// Removes the files of FOLDER/report that `data` does not list: those of an earlier page. Other files stay.
void remove_other_parts(const nlohmann::json& data, const std::filesystem::path& folder);

/// Whether a file of this name in FOLDER/report is a part of a page.
bool is_part_name(const std::string& name);

/// Bytes of the page with these data.
std::size_t page_bytes(const nlohmann::json& data);

}  // namespace marrow::cli
