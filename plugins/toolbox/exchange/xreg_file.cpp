// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/exchange/xreg_file.hpp"

#include <cmath>

#include "hdf5.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/names.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"

namespace marrow::exchange {
namespace {

constexpr const char *kPositiveZ = "origin-at-focal-pt-det-pos-z", *kNegativeZ = "origin-at-focal-pt-det-neg-z",
                     *kOnDetector = "origin-on-det";
constexpr int kMostProjections = 10000;

std::string group_of(int projection) { return formatted("proj-{:03}", projection); }

int side_px(const Hdf5Reader& file, const std::string& key) {
  const double side = file.number(key);
  if (!(side >= 1 && side <= 65536) || side != std::floor(side))
    file.refuse(key, formatted("expected 1 to 65536 pixels, got {:f}", side));
  return int(side);
}

double spacing_mm(const Hdf5Reader& file, const std::string& key) {
  const double spacing = file.number(key);
  if (!(spacing >= 1e-6 && spacing <= 1000))
    file.refuse(key, formatted("expected the size of a pixel in mm, between 1e-6 and 1000, got {:f}", spacing));
  return spacing;
}

template <int Size>
Eigen::Matrix<double, Size, Size> matrix(const Hdf5Reader& file, const std::string& key) {
  const std::vector<double> values = file.numbers(key, std::size_t(Size * Size));
  for (const double value : values)
    if (std::abs(value) > 1e9) file.refuse(key, formatted("expected numbers of at most 1e9, got {:f}", value));
  return Eigen::Map<const Eigen::Matrix<double, Size, Size, Eigen::RowMajor>>(values.data());
}

/// `where`: "" or the group with a "/" at its end.
XregProjection read_camera(const Hdf5Reader& file, const std::string& where) {
  XregProjection p;
  p.frame = file.text(where + "cam-coord-frame-type");
  if (p.frame != kPositiveZ && p.frame != kNegativeZ && p.frame != kOnDetector)
    file.refuse(where + "cam-coord-frame-type", "expected " + std::string(kPositiveZ) + ", " + kNegativeZ + " or " +
                                                    kOnDetector + ", got " +
                                                    in_quotes(printable(p.frame.substr(0, 60))));
  p.height_px = side_px(file, where + "num-rows");
  p.width_px = side_px(file, where + "num-cols");
  p.row_spacing_mm = spacing_mm(file, where + "row-spacing");
  p.column_spacing_mm = spacing_mm(file, where + "col-spacing");
  p.intrinsic = matrix<3>(file, where + "intrinsic");
  p.extrinsic = matrix<4>(file, where + "extrinsic");
  if (!rotation_near(p.extrinsic.topLeftCorner<3, 3>()) ||
      (p.extrinsic.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() > 1e-9)
    file.refuse(where + "extrinsic", "expected a rotation and a translation as a 4x4 matrix; the file is damaged");
  if ((p.intrinsic.row(2) - Eigen::RowVector3d(0, 0, 1)).cwiseAbs().maxCoeff() > 1e-9 || p.intrinsic(1, 0) != 0)
    file.refuse(where + "intrinsic", "expected the rows (f, s, u), (0, f, v), (0, 0, 1); the file is damaged");
  return p;
}

}  // namespace

std::vector<XregProjection> read_xreg(const std::filesystem::path& path) {
  const Hdf5Reader file(path);
  if (file.has("intrinsic")) return {read_camera(file, "")};
  const double count = file.number("num-projs");
  if (!(count >= 1 && count <= kMostProjections) || count != std::floor(count))
    file.refuse("num-projs", formatted("expected 1 to 10000 projections, got {:f}", count));
  std::vector<XregProjection> projections;
  for (int i = 0; i < int(count); ++i) {
    const std::string group = group_of(i);
    projections.push_back(read_camera(file, group + "/cam/"));
    for (const std::string& name : file.names_in(group + "/landmarks")) {
      const std::string key = group + "/landmarks/" + name;
      if (const std::string fault = fault_of_item_name(name); !fault.empty()) file.refuse(key, "its name " + fault);
      const std::vector<double> pixel = file.numbers(key, 2);
      if (std::max(std::abs(pixel[0]), std::abs(pixel[1])) > 1e6)
        file.refuse(key, formatted("expected a column and a row of at most 1e6, got {:f}, {:f}", pixel[0], pixel[1]));
      projections.back().landmarks.push_back({name, {pixel[0], pixel[1]}});
    }
  }
  return projections;
}

Camera camera_of(const XregProjection& p, Mirror mirror, const std::string& what) {
  const Eigen::Vector2i pixels(p.width_px, p.height_px);
  if (p.frame == kPositiveZ && mirror == Mirror::none && p.intrinsic(0, 0) > 0 && p.intrinsic(1, 1) > 0) {
    Camera camera{p.width_px, p.height_px, p.intrinsic, {"camera", "world"}};  // as it is, to the last bit
    camera.camera_from_world.rotation = rotation_near(p.extrinsic.topLeftCorner<3, 3>()).value();
    camera.camera_from_world.translation_mm = p.extrinsic.topRightCorner<3, 1>();
    check_camera(camera, what);
    return camera;
  }
  Eigen::Matrix<double, 3, 4> in_camera = p.extrinsic.topRows<3>();
  if (p.frame == kOnDetector) {
    // The distance from the detector becomes that from the source, at the focal length.
    const double focal_mm =
        0.5 * (std::abs(p.intrinsic(0, 0)) * p.column_spacing_mm + std::abs(p.intrinsic(1, 1)) * p.row_spacing_mm);
    in_camera.row(2) = focal_mm * Eigen::RowVector4d(0, 0, 0, 1) - in_camera.row(2);
  }
  // What lies in front of the source has negative z in one frame, so the third coordinate's sign is turned.
  const double sign = p.frame == kNegativeZ ? -1 : 1;
  return camera_of(Eigen::Matrix<double, 3, 4>(sign * p.intrinsic * in_camera), pixels, mirror, what);
}

std::vector<ShownLandmark> landmarks_of(const XregProjection& projection, Mirror mirror) {
  std::vector<ShownLandmark> landmarks = projection.landmarks;
  for (ShownLandmark& landmark : landmarks)
    landmark.pixel = mirrored(landmark.pixel, mirror, projection.width_px, projection.height_px);
  return landmarks;
}

XregProjection xreg_projection(const Camera& camera, const Eigen::Vector2d& pixel_mm,
                               std::vector<ShownLandmark> landmarks) {
  XregProjection p{camera.width_px,
                   camera.height_px,
                   pixel_mm.x(),
                   pixel_mm.y(),
                   kPositiveZ,
                   camera.intrinsics,
                   Eigen::Matrix4d::Identity(),
                   std::move(landmarks)};
  p.extrinsic.topLeftCorner<3, 3>() = camera.camera_from_world.rotation;
  p.extrinsic.topRightCorner<3, 1>() = camera.camera_from_world.translation_mm;
  return p;
}

std::string xreg_bytes(const std::vector<XregProjection>& projections) {
  Hdf5Writer file;
  const auto put = [&](const std::string& key, const auto& matrix) {
    std::vector<double> rows;
    for (Eigen::Index r = 0; r < matrix.rows(); ++r)
      for (Eigen::Index c = 0; c < matrix.cols(); ++c) rows.push_back(matrix(r, c));
    file.matrix(key, rows, std::size_t(matrix.rows()), std::size_t(matrix.cols()));
  };
  file.attribute("/", "xreg-type", "proj-data");
  file.whole_number("num-projs", projections.size());
  for (std::size_t i = 0; i < projections.size(); ++i) {
    const XregProjection& p = projections[i];
    const std::string group = group_of(int(i)), cam = group + "/cam";
    file.group(group);
    file.group(cam);
    file.attribute(cam, "xreg-type", "cam-model");
    file.whole_number(cam + "/num-rows", (unsigned long)(p.height_px));
    file.whole_number(cam + "/num-cols", (unsigned long)(p.width_px));
    file.number(cam + "/row-spacing", p.row_spacing_mm);
    file.number(cam + "/col-spacing", p.column_spacing_mm);
    file.text(cam + "/cam-coord-frame-type", p.frame);
    put(cam + "/intrinsic", p.intrinsic);
    put(cam + "/extrinsic", p.extrinsic);
    if (p.landmarks.empty()) continue;
    file.group(group + "/landmarks");
    for (const ShownLandmark& landmark : p.landmarks) {
      if (landmark.name.find('/') != std::string::npos)
        throw Error("landmark '" + printable(landmark.name) +
                    "': a file of xReg cannot hold a name with '/'; rename it");
      put(group + "/landmarks/" + landmark.name, landmark.pixel);
    }
  }
  return file.bytes();
}

}  // namespace marrow::exchange
