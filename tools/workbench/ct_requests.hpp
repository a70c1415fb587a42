// SPDX-License-Identifier: Apache-2.0
#pragma once
// The parts of the page "Case" that work on its CT share the CTs in memory.
#include "workbench/ct_memory.hpp"
#include "workbench/workbench.hpp"

namespace marrow::workbench {

/// Size and time of change of a CT's file, or of all files of its folder. While these stay, the content does, too.
struct FilesOfCt {
  std::uintmax_t bytes = 0;
  std::string description;

  /// Throws Error if there is no such file or folder, or the folder holds too many files.
  explicit FilesOfCt(const std::filesystem::path& place);

 private:
  void add(const std::filesystem::path& file);
};

/// The `content` of a CT for CtMemory: its place, its files, and the options of a case's `ct`.
std::string content_of_ct(const std::filesystem::path& place, nlohmann::json ct, const FilesOfCt& files);

/// POST /api/ct/open, GET /api/ct/slice
void add_ct_reading(Server& server, Workbench& workbench, const std::shared_ptr<CtMemory>& memory);
/// POST /api/labels/open, GET /api/labels/slice
void add_label_reading(Server& server, Workbench& workbench, const std::shared_ptr<CtMemory>& memory);
/// POST /api/segment, GET /api/segmentation/outlines, GET /api/segmentation/surface
void add_segmenting(Server& server, Workbench& workbench, const std::shared_ptr<CtMemory>& memory);
/// POST /api/case/save
void add_saving(Server& server, Workbench& workbench, const std::shared_ptr<CtMemory>& memory);

}  // namespace marrow::workbench
