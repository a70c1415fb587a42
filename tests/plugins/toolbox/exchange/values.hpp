// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the tests of other programs' formats share: nodes that read and write files, called as they are shipped.
#include "tests/plugins/read/damage.hpp"
#include "tests/plugins/read/reading.hpp"
#include "tests/plugins/write/writing.hpp"

namespace marrow::test {

/// Files of other programs, beside the tests that read them.
inline const std::filesystem::path kData =
    std::filesystem::path(MARROW_SOURCE_DIR) / "tests/plugins/toolbox/exchange/data";

/// The text with other ends of its lines than \n.
inline std::string with_line_ends(const std::string& text, const std::string& line_end) {
  return with_each(text, "\n", line_end);
}

/// RTK's geometry: 1000 mm from the source to the isocentre, 1500 mm to the detector.
inline std::string rtk_geometry(const std::string& projections) {
  return "<?xml version=\"1.0\"?>\n<!DOCTYPE RTKGEOMETRY>\n<RTKThreeDCircularGeometry version=\"3\">\n"
         "  <SourceToIsocenterDistance>1000</SourceToIsocenterDistance>\n"
         "  <SourceToDetectorDistance>1500</SourceToDetectorDistance>\n" +
         projections + "</RTKThreeDCircularGeometry>\n";
}

/// Calls write.NODE with one input, writes what it gives by its writer, and returns the file's bytes.
template <class File, class T>
std::string written_by(const std::string& node, const std::string& port, const T& value,
                       const std::filesystem::path& to, const shipped::Options& options = {}) {
  const shipped::Outputs outputs = shipped::call(node, {{port, shipped::item(value)}}, options);
  writing::write(outputs.begin()->second.as<File>(), to);
  return bytes_of(to);
}

}  // namespace marrow::test
