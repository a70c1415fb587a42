// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "marrow/plugin.hpp"
#include "marrow/runtime/pipeline/pipeline.hpp"
#include "marrow/runtime/run/executor.hpp"
#include "tests/harness/message_of.hpp"

namespace runtime_fixture {

/// A folder of a test's own, removed at its end.
class Scratch {
 public:
  Scratch() {
    std::string name = (std::filesystem::temp_directory_path() / "marrow-test-XXXXXX").string();
    path = mkdtemp(name.data());
  }
  ~Scratch() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
  std::filesystem::path write(const std::string& name, const std::string& text) const {
    std::ofstream(path / name) << text;
    return path / name;
  }
  std::filesystem::path path;
};

inline const marrow::Catalogue& test_catalogue() {
  static const marrow::Catalogue catalogue({std::filesystem::path(MARROW_BINARY_DIR) / "tests" / "plugins"});
  return catalogue;
}

}  // namespace runtime_fixture
