// SPDX-License-Identifier: Apache-2.0
#pragma once
// The HDF5 file of full resolution of the DeepFluoro data set: CTs of six specimens with labels and landmarks, and
// X-ray images with the poses of pelvis and femurs (Grupp et al., IJCARS 15:759, 2020; layout: docs/formats.md).
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "marrow/domain/features.hpp"
#include "marrow/domain/volume.hpp"
#include "marrow/toolbox/exchange/xreg_file.hpp"

namespace marrow::exchange {

class Hdf5Reader;

/// An X-ray image of a specimen.
struct DeepfluoroImage {
  std::string specimen, name;  ///< such as 17-1882 and 005
};

/// How an image shows a bone: its camera in the frame of the CT, and the landmarks that the file marks in it.
struct DeepfluoroView {
  Camera camera;  ///< of the image turned over as `mirror` says; its world is the CT, with the bone at its place there
  Mirror mirror = Mirror::none;
  std::vector<ShownLandmark> landmarks;  ///< in the image turned over; some lie outside of it
};

/// What is taken otherwise than the file's authors document it.
struct DeepfluoroReading {
  bool inverse_extrinsic = false, inverse_pose = false;
  bool rows_first = false;  ///< the marks in the images are (row, column)
};

class DeepfluoroFile {
 public:
  /// Throws Error if the file cannot be read, or has no specimen.
  explicit DeepfluoroFile(const std::filesystem::path& path);
  ~DeepfluoroFile();

  /// All images, by specimen and name.
  const std::vector<DeepfluoroImage>& images() const { return images_; }
  std::vector<std::string> specimens() const;

  /// The following throw Error with the key of a value that is missing or wrong.
  Volume ct(const std::string& specimen) const;
  /// For each voxel of the CT whether its label is one of the bone's.
  std::vector<std::uint8_t> labelled(const std::string& specimen, const std::string& bone, const Grid& grid) const;
  std::vector<Landmarks::Point> landmarks(const std::string& specimen) const;
  DeepfluoroView view(const DeepfluoroImage& image, const std::string& bone, const DeepfluoroReading& reading) const;
  /// Whether the file says that the image shows enough of the bone for its pose to be right.
  bool shows(const DeepfluoroImage& image, const std::string& bone) const;
  /// The pixels, turned over: large where the beam was not attenuated.
  Image pixels(const DeepfluoroImage& image, const DeepfluoroView& view) const;

 private:
  std::unique_ptr<const Hdf5Reader> file_;
  std::vector<DeepfluoroImage> images_;
};

}  // namespace marrow::exchange
