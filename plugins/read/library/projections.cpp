// SPDX-License-Identifier: Apache-2.0
#include "marrow/read/projections.hpp"

#include <numeric>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/toolbox/exchange/rtk_geometry.hpp"
#include "marrow/toolbox/exchange/xreg_file.hpp"
#include "marrow/toolbox/files/header_lines.hpp"

namespace marrow::read {
namespace {

/// The cameras of the projections with these numbers, or of all. `camera(one, what)` makes one.
template <class Projection, class MakeCamera>
std::vector<Camera> cameras_of(const std::vector<Projection>& all, std::vector<int> numbers, const std::string& what,
                               MakeCamera camera) {
  if (numbers.empty()) {
    numbers.resize(all.size());
    std::iota(numbers.begin(), numbers.end(), 0);
  }
  std::vector<Camera> cameras;
  for (const int number : numbers) {
    if (number < 0 || std::size_t(number) >= all.size())
      throw Error(
          formatted("{}: has {} projections, counted from 0; there is no projection {}", what, all.size(), number));
    cameras.push_back(camera(all[std::size_t(number)], formatted("{}: projection {}", what, number)));
  }
  return cameras;
}

}  // namespace

Projections projections_in(const std::filesystem::path& path) {
  const std::string end = files::in_small_letters(path.extension().string());
  return end == ".xml" ? Projections::rtk : end == ".h5" || end == ".hdf5" ? Projections::xreg : Projections::none;
}

int projection_number(double number, const std::string& what) {
  if (!(number >= 0 && number <= 1e6) || number != double(int(number)))
    throw Error(formatted("{}: projections: expected whole numbers from 0, got {:f}", what, number));
  return int(number);
}

std::size_t count_projections(const std::filesystem::path& path) {
  return projections_in(path) == Projections::rtk ? exchange::read_rtk(path).size() : exchange::read_xreg(path).size();
}

std::vector<Camera> read_projections(const std::filesystem::path& path, const std::vector<int>& numbers,
                                     const exchange::ImageSize& size, exchange::Mirror mirror, double scale) {
  if (projections_in(path) == Projections::none)
    throw Error(path.string() + ": expected RTK's geometry (.xml) or xReg's projection data (.h5)");
  exchange::ImageSize in_file = size;  // in the file's unit, as RTK's distances are
  for (double& side : in_file.pixel_mm) side /= scale;
  for (double& place : in_file.corner_mm) place /= scale;
  std::vector<Camera> cameras = projections_in(path) == Projections::rtk
                                    ? cameras_of(exchange::read_rtk(path), numbers, path.string(),
                                                 [&](const exchange::RtkProjection& one, const std::string& what) {
                                                   return camera_of(one, in_file, mirror, what);
                                                 })
                                    : cameras_of(exchange::read_xreg(path), numbers, path.string(),
                                                 [&](const exchange::XregProjection& one, const std::string& what) {
                                                   return camera_of(one, mirror, what);
                                                 });
  for (Camera& camera : cameras) camera.camera_from_world.translation_mm *= scale;
  return cameras;
}

}  // namespace marrow::read
