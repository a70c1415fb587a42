// SPDX-License-Identifier: Apache-2.0
#pragma once
// The parts of the page "Case" that work on its CT share the CTs in memory.
#include "workbench/ct_memory.hpp"
#include "workbench/workbench.hpp"

namespace marrow::workbench {

/// POST /api/ct/open, GET /api/ct/slice
void add_ct_reading(Server& server, Workbench& workbench, const std::shared_ptr<CtMemory>& memory);
/// POST /api/segment, GET /api/segmentation/outlines, GET /api/segmentation/surface
void add_segmenting(Server& server, Workbench& workbench, const std::shared_ptr<CtMemory>& memory);
/// POST /api/case/save
void add_saving(Server& server, Workbench& workbench);

}  // namespace marrow::workbench
