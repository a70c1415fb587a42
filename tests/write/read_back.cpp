// SPDX-License-Identifier: Apache-2.0
// read.case beside the writer under test: each is a plugin of its own, so their entry points must not share a name
// here.
#include "plugins/read/case.cpp"

marrow::Case read_back(const std::filesystem::path& folder) { return read_case({folder}); }
