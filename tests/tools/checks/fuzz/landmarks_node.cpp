// SPDX-License-Identifier: Apache-2.0
#include "node_readers.hpp"

#include "tests/harness/without_registration.hpp"  // before the node

#include "plugins/read/landmarks.cpp"

void marrow::fuzz::read_landmarks(const std::filesystem::path& path) {
  Options options;
  options.path = path;
  landmarks(options);
}
