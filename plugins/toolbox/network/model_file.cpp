// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/network/model_file.hpp"

#include <marrow/base/error.hpp>
#include <marrow/runtime/node/context.hpp>
#include <opencv2/core/version.hpp>
#include <regex>

#include "marrow/base/printable.hpp"
#include "marrow/toolbox/files/input_file.hpp"

namespace marrow::network {
namespace {

constexpr std::uint64_t kMostBytes = 512'000'000;
constexpr std::size_t kLongest = 300;

}  // namespace

std::string model_file(const std::filesystem::path& file) {
  now_reading(file);
  return files::read_bytes(file, kMostBytes);
}

std::string reason_of_model(const std::string& message) {
  std::smatch found;
  static const std::regex node("Node \\[([^@\\]]*)@[^\\]]*\\]:\\(([^)]*)\\)");
  if (std::regex_search(message, found, node)) {
    std::string name = found[2];
    name = name.substr(name.find('!') == std::string::npos ? 0 : name.find('!') + 1);
    return "OpenCV " CV_VERSION " cannot compute its layer '" + printable(name) + "' of the type " +
           printable(found[1].str()) +
           "; export the network with other layers (Conv, ConvTranspose, BatchNormalization, Relu, MaxPool, Concat, "
           "Add, Sigmoid), with opset_version=11 and for a tile of fixed size";
  }
  static const std::regex damaged("parse onnx model|has_graph", std::regex::icase);
  if (std::regex_search(message, damaged)) return "is no ONNX model, or a damaged one; export it again";
  // The place in OpenCV's source says nothing here.
  static const std::regex frame("OpenCV\\([0-9.]+\\) \\S+ error: |\\s+$");
  return "OpenCV says: " + printable(cut(std::regex_replace(message, frame, ""), kLongest));
}

}  // namespace marrow::network
