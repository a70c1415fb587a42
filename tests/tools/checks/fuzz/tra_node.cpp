// SPDX-License-Identifier: Apache-2.0
#include "node_readers.hpp"

#include "tests/harness/without_registration.hpp"  // before the node

#include "plugins/read/tra.cpp"

void marrow::fuzz::read_track(const std::filesystem::path& path) { read_tra(nullptr, {path}); }
