// SPDX-License-Identifier: Apache-2.0
#pragma once
// A network of one convolution in a folder of its own, with its description.
#include <filesystem>
#include <fstream>
#include <string>

#include "marrow/base/temporary_folder.hpp"
#include "onnx_model.hpp"

namespace marrow::test {

inline const std::string kPlain = R"(marrow-network: 1
name: plain
help: a network of one convolution
version: 1.0.0
licence: Apache-2.0
trained: {data: nothing, good_for: tests, not_for: anything else}
input:
  values: grey_values
  bone: bright
  pixel_px: 1
  normalise: {method: fixed, low: 0, high: 1}
  size_px: [32, 32]
  overlap_px: 8
outputs:
  edge_strength: {layer: maps, activation: none}
)";

/// The text with another one in the place of `from`, which must be there.
inline std::string with(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

class Written {
 public:
  Written(const std::string& model, const std::string& description = kPlain) {
    std::ofstream(file()) << description;
    std::ofstream(folder_.path() / "plain.onnx", std::ios::binary) << model;
  }
  std::filesystem::path file() const { return folder_.path() / "plain.yaml"; }

 private:
  TemporaryFolder folder_{new_temporary_folder("network")};
};

}  // namespace marrow::test
