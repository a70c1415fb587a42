// SPDX-License-Identifier: Apache-2.0
#include "node_readers.hpp"

#include "tests/harness/without_registration.hpp"  // before the node

#include "plugins/read/implant.cpp"

void marrow::fuzz::read_implant_holes(const std::filesystem::path& path) { read_holes(path); }
