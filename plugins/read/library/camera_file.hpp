// SPDX-License-Identifier: Apache-2.0
#pragma once
// The camera of any file that marrow reads: its own YAML, and the files of XMALab, MayaCam, plastimatch, RTK, xReg and
// JointTrack. And views: images with their cameras.
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "marrow/runtime/node/context.hpp"
#include "marrow/toolbox/exchange/cameras.hpp"
#include "marrow/toolbox/files/camera_file.hpp"

namespace marrow::read {

/// `own` is marrow's YAML.
enum class CameraFormat { own, xmalab, maya, plastimatch, rtk, xreg, jointtrack };

/// By the end of the name: .yaml and .yml are marrow's, .xml RTK's, .h5 and .hdf5 xReg's. Any other file is a text: of
/// plastimatch, JointTrack or a MayaCam if it begins as their files do, else of XMALab.
CameraFormat camera_format(const std::filesystem::path& path);

/// What a file of another program leaves open.
struct CameraReading {
  int projection = -1;       ///< RTK and xReg: its number, from 0; -1: the file must hold only one
  exchange::ImageSize size;  ///< size_px: plastimatch, RTK, JointTrack; the others: RTK
  exchange::Mirror mirror = exchange::Mirror::none;  ///< RTK and xReg: how the image was turned over
  double scale = 1;                                  ///< all but marrow's YAML: converts the file's unit to mm
};

/// The camera in a file of any format. Only marrow's own YAML holds a distortion. `size.size_px` may be given for any
/// format. Throws Error for any other value that the format does not need, if the camera's images have another size
/// than `size_px`, if the file holds several projections and none is chosen, and as the format's reader does.
files::CameraInFile read_camera(const std::filesystem::path& path, const CameraReading& reading);

/// files::doubt_about_distance() of a camera from this file, with the file's name; empty for marrow's own format, which
/// is always in mm.
std::string doubt_about_unit(const std::filesystem::path& path, const Camera& camera, double scale);

/// Files that hold the cameras of several projections, by the end of their names: RTK's geometry (.xml) and xReg's
/// projection data (.h5, .hdf5).
enum class Projections { none, rtk, xreg };
Projections projections_in(const std::filesystem::path& path);

/// Converts the number in an option to that of a projection. Throws Error, with `what` in front, unless it is a whole
/// number from 0.
int projection_number(double number, const std::string& what);

/// The cameras of the projections with these numbers, from 0; of all if `numbers` is empty. `size` is only for RTK.
/// `scale` converts the file's unit to mm. Throws Error as the readers of the two formats do, and if there is no such
/// projection.
std::vector<Camera> read_projections(const std::filesystem::path& path, const std::vector<int>& numbers,
                                     const exchange::ImageSize& size, exchange::Mirror mirror, double scale);

/// Reads a calibration file in the format that marrow writes. Throws Error if it cannot be read, or for missing or
/// wrong values.
Calibration read_calibration_file(const std::filesystem::path& path);

/// The files of a view. The camera is `*camera` if that is not null, else it is read from `camera_file`.
struct ViewSource {
  std::string name;
  std::filesystem::path image;
  const Camera* camera = nullptr;
  std::filesystem::path camera_file;
  std::filesystem::path calibration;  ///< may be empty
  std::filesystem::path distortion;   ///< may be empty
  int frame = 0;                      ///< of the image file, from 1; 0: the file must have only one
  std::string mirror = "none";        ///< as files::turned_over() takes it; the camera is that of the image afterwards
  int projection = -1;                ///< as CameraReading has it
  std::vector<double> pixel_mm{}, corner_mm{};
  double scale = 1;  ///< as CameraReading has it
};

/// The camera of this name. Throws Error with the known names if there is none.
const Camera& camera_of_view(const std::string& view, const List<Camera>& cameras);

/// How the images of a view were taken.
struct ViewCamera {
  files::CameraInFile camera;
  std::optional<Calibration> calibration;  ///< its camera matrix replaces the camera's
};

/// Reads the camera of a view whose image is `image`, its calibration and its distortion. Warns as doubt_about_unit()
/// does. Throws Error if a file cannot be read, or does not fit the image, or if two of them describe a distortion.
ViewCamera read_view_camera(const ViewSource& source, const Image& image, const Context& context);

/// A view with a plain pinhole camera: a distortion is removed from the image. Throws Error if sizes do not match.
View view_of(const std::string& name, Image image, const ViewCamera& camera);

/// A view, and how exactly its camera is known.
struct ViewAsStated {
  View view;
  geometry::CameraDeviations camera_deviations;
};

/// Reads a view. Throws Error as the functions above do, or if the image cannot be read.
ViewAsStated read_view_files(const ViewSource& source, const Context& context);

}  // namespace marrow::read
