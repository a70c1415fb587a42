// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the tests of other programs' formats share: nodes that read and write files, called as they are shipped.
#include "tests/plugins/read/files.hpp"
#include "tests/plugins/read/hostile.hpp"
#include "tests/plugins/read/reading.hpp"
#include "tests/plugins/write/writing.hpp"

namespace marrow::test {

/// Calls write.NODE with one input, writes what it gives by its writer, and returns the file's bytes.
template <class File, class T>
std::string written_by(const std::string& node, const std::string& port, const T& value,
                       const std::filesystem::path& to, const shipped::Options& options = {}) {
  const shipped::Outputs outputs = shipped::call(node, {{port, shipped::item(value)}}, options);
  writing::write(outputs.begin()->second.as<File>(), to);
  return bytes_of(to);
}

}  // namespace marrow::test
