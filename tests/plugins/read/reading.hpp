// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the shipped readers make of files.
#include <filesystem>
#include <string>

#include "marrow/domain/case.hpp"
#include "shipped.hpp"

namespace marrow::test {

/// The one output of a reader.
template <class T>
T read_by(const std::string& node, const std::filesystem::path& path, shipped::Options options = {},
          const Context& context = Context()) {
  options["path"] = path.string();
  return shipped::call(node, {}, options, context).begin()->second.as<T>();
}

/// `starts`: the folder of poses that take the place of the case's starts; empty for none.
inline Case case_at(const std::filesystem::path& folder, const std::filesystem::path& starts = {}) {
  const shipped::Outputs outputs =
      shipped::call("read.case", {}, {{"path", folder.string()}, {"starts", starts.string()}});
  Case read;
  read.ct = outputs.at("ct").as<Volume>();
  read.seeds = outputs.at("seeds").as_list<Seeds>();
  read.views = outputs.at("views").as_list<View>();
  read.start = outputs.at("start").as_list<Pose>();
  read.truth = outputs.at("truth").as_list<Truth>();
  return read;
}

struct ViewOptions {
  std::string name;
  std::filesystem::path image, camera{}, calibration{};
};

/// `camera`: the one that is wired to read.view, or nullptr.
inline View view_from(const Camera* camera, const ViewOptions& options) {
  shipped::Inputs inputs;
  if (camera) inputs["camera"] = shipped::item(*camera);
  const shipped::Outputs outputs = shipped::call("read.view", inputs,
                                                 {{"name", options.name},
                                                  {"image", options.image.string()},
                                                  {"camera", options.camera.string()},
                                                  {"calibration", options.calibration.string()}});
  return outputs.at("view").as<View>();
}

}  // namespace marrow::test
