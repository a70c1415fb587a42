// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/files/image_sides.hpp"

#include <Eigen/Geometry>

#include "dicom_file.hpp"
#include "file_format.hpp"
#include "marrow/toolbox/files/volume_file.hpp"
#include "marrow/toolbox/files/xray_header.hpp"
#include "patient_orientation.hpp"

namespace marrow::files {
namespace {

constexpr DicomTag kHorizontalFlip{0x0018, 0x7034, "FieldOfViewHorizontalFlip"};

bool has_dicom_header(const std::filesystem::path& path) { return file_format(path) == FileFormat::dicom; }

/// The patient's side that a direction points to most.
std::string side_of(const Eigen::Vector3d& direction) {
  static const char* kSides[3][2] = {{"left", "right"}, {"back", "front"}, {"head", "feet"}};
  Eigen::Index axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  return kSides[axis][direction[axis] < 0];
}

}  // namespace

std::vector<std::string> doubts_about_sides(const std::filesystem::path& image, int frame) {
  if (!has_dicom_header(image)) return {};
  const DicomFile file(image);
  const DicomHeader header(file, std::max(1, frame));
  const auto oriented = patient_orientation(header);
  const std::string advice =
      "compare it with the anatomy, or mark landmarks in two views, and mirror the image if it is";
  if (!oriented) {
    if (header.text(kHorizontalFlip).value_or("") != "YES") return {};
    return {image.string() + ": was flipped left to right after it was taken (" + kHorizontalFlip.text() + "), and " +
            kPatientOrientation.text() + " does not say how the patient lies in it; it may be mirrored: " + advice};
  }
  if (header.number(kPrimaryAngle) && header.number(kSecondaryAngle)) return {};  // mirrored back if it was mirrored
  return {image.string() + ": the patient's " + side_of(oriented->right) + " is on its right and the " +
          side_of(oriented->down) + " below (" + kPatientOrientation.text() +
          "), but the header does not say from where it was taken; whether it is mirrored is not known: " + advice};
}

std::vector<std::string> doubts_about_sides(const std::filesystem::path& image, int frame, const Camera& camera) {
  if (!has_dicom_header(image)) return {};
  const DicomFile file(image);
  const auto oriented = patient_orientation(DicomHeader(file, std::max(1, frame)));
  if (!oriented) return doubts_about_sides(image, frame);
  constexpr double kClear = 0.5;  // the patient's axes and the camera's differ by less than 60 degrees
  const bool is_turned = is_mirrored_as_read(image, frame);
  const Eigen::Vector3d right = is_turned ? Eigen::Vector3d(-oriented->right) : oriented->right;
  const Eigen::Vector3d away = camera.camera_from_world.rotation.row(2).transpose();  // from the source
  if (!(right.cross(oriented->down).dot(away) < -kClear)) return {};
  return {image.string() + ": is mirrored: by its header (" + kPatientOrientation.text() + ") the patient's " +
          side_of(right) + " is on the right and the " + side_of(oriented->down) +
          " below, as nobody sees it from the source of this camera; mirror the image, or correct the angles"};
}

}  // namespace marrow::files
