// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the shipped readers make of files.

#include "shipped.hpp"

namespace marrow::test {

/// The one output of a reader.
template <class T>
T read_by(const std::string& node, const std::filesystem::path& path, shipped::Options options = {},
          const Context& context = Context()) {
  options["path"] = path.string();
  return shipped::call(node, {}, options, context).begin()->second.as<T>();
}

/// The same where it is a list.
template <class T>
List<T> list_by(const std::string& node, const std::filesystem::path& path, shipped::Options options = {}) {
  options["path"] = path.string();
  return shipped::call(node, {}, options).begin()->second.as_list<T>();
}

/// What a call says while it runs, for call(context).
template <class Call>
std::vector<std::string> said_by(Call call, LogLevel least = LogLevel::debug) {
  std::vector<std::string> lines;
  Context::Hooks hooks;
  hooks.log = [&](std::string_view text, LogLevel level) {
    if (level >= least) lines.emplace_back(text);
  };
  call(Context(hooks));
  return lines;
}

/// Reads the folder of a case. `starts`: the folder of poses that take the place of the case's starts; empty for none.
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

/// A camera file of XMALab's: f = 10 px, the world's axes, the origin 600 mm in front of the source.
inline std::string xmalab_camera(int width_px, int height_px, const std::string& distance_mm = "600") {
  return "image size\n" + std::to_string(width_px) + "," + std::to_string(height_px) +
         "\n\ncamera matrix\n10,0,3\n0,10,2\n0,0,1\n\nrotation\n1,0,0\n0,1,0\n0,0,1\n\ntranslation\n0\n0\n" +
         distance_mm + "\n";
}

}  // namespace marrow::test
