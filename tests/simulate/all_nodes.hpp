// SPDX-License-Identifier: Apache-2.0
#pragma once
// All simulation nodes in one file, for tests of the whole chain: each keeps its own entry.
#define marrow_register_nodes register_femur
#define marrow_plugin_entry femur_entry
#include "plugins/simulate/femur.cpp"
#undef marrow_register_nodes
#undef marrow_plugin_entry
#define marrow_register_nodes register_surface
#define marrow_plugin_entry surface_entry
#include "plugins/simulate/surface.cpp"
#undef marrow_register_nodes
#undef marrow_plugin_entry
#define marrow_register_nodes register_fracture
#define marrow_plugin_entry fracture_entry
#include "plugins/simulate/fracture.cpp"
#undef marrow_register_nodes
#undef marrow_plugin_entry
#define marrow_register_nodes register_ct
#define marrow_plugin_entry ct_entry
#include "plugins/simulate/ct.cpp"
#undef marrow_register_nodes
#undef marrow_plugin_entry
#define marrow_register_nodes register_fluoroscopy
#define marrow_plugin_entry fluoroscopy_entry
#include "plugins/simulate/fluoroscopy.cpp"
#undef marrow_register_nodes
#undef marrow_plugin_entry
#define marrow_register_nodes register_case
#define marrow_plugin_entry case_entry
#include "plugins/simulate/case.cpp"
#undef marrow_register_nodes
#undef marrow_plugin_entry
