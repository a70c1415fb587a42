// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/files/xray_header.hpp"

#include <Eigen/LU>
#include <cmath>

#include "dicom_pixels.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::files {
namespace {

constexpr DicomTag kDistanceSourceToDetector{0x0018, 0x1110, "DistanceSourceToDetector"};
constexpr DicomTag kDistanceSourceToPatient{0x0018, 0x1111, "DistanceSourceToPatient"};
constexpr DicomTag kDistanceSourceToIsocenter{0x0018, 0x9402, "DistanceSourceToIsocenter", DicomTag::Kind::fl};
constexpr DicomTag kMagnification{0x0018, 0x1114, "EstimatedRadiographicMagnificationFactor"};
constexpr DicomTag kImagerPixelSpacing{0x0018, 0x1164, "ImagerPixelSpacing"};
constexpr DicomTag kFieldShape{0x0018, 0x1147, "FieldOfViewShape"};
constexpr DicomTag kFieldDimensions{0x0018, 0x1149, "FieldOfViewDimensions"};
constexpr DicomTag kIntensifierSize{0x0018, 0x1162, "IntensifierSize"};
constexpr DicomTag kSpacingCalibration{0x0028, 0x0a02, "PixelSpacingCalibrationType"};
constexpr DicomTag kPrimaryIncrement{0x0018, 0x1520, "PositionerPrimaryAngleIncrement"};
constexpr DicomTag kSecondaryIncrement{0x0018, 0x1521, "PositionerSecondaryAngleIncrement"};
constexpr DicomTag kPositionerMotion{0x0018, 0x1500, "PositionerMotion"};
constexpr DicomTag kPatientPosition{0x0018, 0x5100, "PatientPosition"};
constexpr DicomTag kIntensitySign{0x0028, 0x1041, "PixelIntensityRelationshipSign", DicomTag::Kind::ss};
constexpr DicomTag kFieldOfViewOrigin{0x0018, 0x7030, "FieldOfViewOrigin"};
constexpr DicomTag kIsocentreProjection{0x0018, 0x9430, "PositionOfIsocenterProjection", DicomTag::Kind::fl};

/// Collects what is missing, so that one message names all.
class Wanted {
 public:
  explicit Wanted(const DicomHeader& header) : header_(header) {}
  void missing(const std::string& what, const std::string& advice) {
    text_ += (text_.empty() ? "" : "; ") + what + (advice.empty() ? "" : " (" + advice + ")");
  }
  double number(const DicomTag& tag, const std::string& advice) {
    const auto value = header_.number(tag);
    if (!value) missing(tag.text(), advice);
    return value.value_or(0);
  }
  void finish() const {
    if (!text_.empty())
      throw Error(header_.path().string() + ": its header does not say how it was taken; missing: " + text_);
  }

 private:
  const DicomHeader& header_;
  std::string text_;
};

void check_modality(const DicomHeader& header) {
  const std::string modality = header.text(kModality).value_or("");
  if (modality == "XA" || modality == "RF") return;
  throw Error(header.path().string() + ": is of modality '" + modality +
              "'; expected XA or RF, whose headers hold a C-arm's angles and distances");
}

double source_to_isocentre(const DicomHeader& header, double source_to_detector_mm, double given_mm, Wanted& wanted) {
  if (given_mm > 0) return given_mm;
  for (const DicomTag& tag : {kDistanceSourceToPatient, kDistanceSourceToIsocenter})
    if (const auto value = header.number(tag); value && *value > 0) return *value;
  if (const auto factor = header.number(kMagnification); factor && *factor > 1) return source_to_detector_mm / *factor;
  wanted.missing(kDistanceSourceToPatient.text() + " or " + kMagnification.text(), "or give source_to_isocentre_mm");
  return 0;
}

/// The size of a pixel on the detector by the field that the image shows: the field of view, which a zoom makes
/// smaller, or else the whole intensifier. The image is taken to show the field from border to border. std::nullopt if
/// the header has neither.
std::optional<Eigen::Vector2d> pixel_of_field_mm(const DicomHeader& header, std::vector<std::string>& warnings) {
  const double columns = header.number(kColumns).value_or(0), rows = header.number(kRows).value_or(0);
  if (!(columns >= 1 && rows >= 1)) return std::nullopt;
  std::vector<double> field_mm = header.numbers(kFieldDimensions, 0).value_or(std::vector<double>{});
  const bool has_field = field_mm.size() == 1 || field_mm.size() == 2;
  if (!has_field) {
    const auto size = header.number(kIntensifierSize);
    if (!size) return std::nullopt;
    field_mm = {*size};
  }
  const std::string tag = (has_field ? kFieldDimensions : kIntensifierSize).text();
  for (const double side : field_mm)
    if (!(side > 0)) throw Error(header.path().string() + formatted(": {} is {:f} mm; give pixel_mm", tag, side));
  const double wide = std::max(columns, rows), narrow = std::min(columns, rows);
  Eigen::Vector2d pixel = Eigen::Vector2d::Constant(field_mm[0] / wide);
  if (field_mm.size() == 2 && header.text(kFieldShape).value_or("RECTANGLE") == "RECTANGLE") {
    // Devices do not agree on which of the two comes first, so the longer one is taken along the longer side.
    const auto [low, high] = std::minmax(field_mm[0], field_mm[1]);
    const Eigen::Vector2d long_and_short(high / wide, low / narrow);
    pixel = columns >= rows ? long_and_short : Eigen::Vector2d(long_and_short.reverse());
  }
  warnings.push_back(header.path().string() +
                     formatted(": {} and {} are missing; a pixel is taken as {:.4g} x {:.4g} mm, because the image of "
                               "{:g} x {:g} px shows a field of {:g}{} mm ({}); {}check the camera with known points, "
                               "or give pixel_mm",
                               kImagerPixelSpacing.text(), kPixelSpacing.text(), pixel.x(), pixel.y(), columns, rows,
                               field_mm[0], field_mm.size() == 2 ? formatted(" x {:g}", field_mm[1]) : std::string(),
                               tag, has_field ? "" : "with a zoom the field, and so the pixel, is smaller; "));
  return pixel;
}

/// Width and height of a pixel on the detector. Both DICOM elements give the distance of rows first, the pixel's
/// height.
Eigen::Vector2d detector_pixel_mm(const DicomHeader& header, double magnification, double given_mm, Wanted& wanted,
                                  std::vector<std::string>& warnings) {
  if (given_mm > 0) return Eigen::Vector2d::Constant(given_mm);
  if (const auto spacing = header.numbers(kImagerPixelSpacing, 2)) return {(*spacing)[1], (*spacing)[0]};
  const auto spacing = header.numbers(kPixelSpacing, 2);
  if (!spacing) {
    if (const auto pixel = pixel_of_field_mm(header, warnings)) return *pixel;
    wanted.missing(kImagerPixelSpacing.text(), "or give pixel_mm");
    return {1, 1};
  }
  Eigen::Vector2d pixel((*spacing)[1], (*spacing)[0]);
  const std::string what = header.path().string() + ": " + kImagerPixelSpacing.text() + " is missing; ";
  if (header.text(kSpacingCalibration)) {
    warnings.push_back(what + kPixelSpacing.text() +
                       " is calibrated to the patient, so it is multiplied by the magnification; check the "
                       "camera with known points");
    return magnification * pixel;
  }
  warnings.push_back(what + kPixelSpacing.text() +
                     " is taken for it, but where it was calibrated to the patient the focal length is too long "
                     "by the magnification; check the camera with known points, or give pixel_mm");
  return pixel;
}

/// The axes to the right and down of the stored image, in the world, from PatientOrientation. There are eight ways to
/// turn and mirror what the camera sees; the one that fits its letters best is taken. std::nullopt if the header does
/// not give it.
struct Stored {
  Eigen::Vector3d right, down;
  bool mirrored = false;
};
std::optional<Stored> stored_axes(const DicomHeader& header, const Eigen::Matrix3d& world_from_camera) {
  const auto oriented = patient_orientation(header);
  if (!oriented) return std::nullopt;
  const Eigen::Vector3d u = world_from_camera.col(0), v = world_from_camera.col(1);
  Stored best;
  double best_fit = 0;
  for (const bool swapped : {false, true})
    for (const double a : {1.0, -1.0})
      for (const double b : {1.0, -1.0}) {
        Stored stored{a * (swapped ? v : u), b * (swapped ? u : v), false};
        stored.mirrored = stored.right.cross(stored.down).dot(world_from_camera.col(2)) < 0;
        if (const double fit = oriented->right.dot(stored.right) + oriented->down.dot(stored.down); fit > best_fit) {
          best_fit = fit;
          best = stored;
        }
      }
  if (best_fit < 1.2)
    throw Error(header.path().string() + ": " + kPatientOrientation.text() + " says '" + oriented->letters +
                "', which no view from these angles shows; one of them is wrong");
  return best;
}

Eigen::Matrix3d carm_axes(double secondary_deg, double primary_deg) {
  return world_from_camera_rotation(radians(secondary_deg), radians(primary_deg));
}

/// Whether the arm moves during the run. Increments of the angles that are all 0 do not count.
bool arm_moves(const DicomHeader& header) {
  if (header.text(kPositionerMotion).value_or("") == "DYNAMIC") return true;
  for (const DicomTag& tag : {kPrimaryIncrement, kSecondaryIncrement})
    for (const double increment : header.numbers(tag, 0).value_or(std::vector<double>{}))
      if (increment != 0) return true;
  return false;
}

void check_motion(const DicomHeader& header, int frame, int frames) {
  if (frame == 1 || (frame == 0 && frames == 1) || !arm_moves(header)) return;
  throw Error(
      header.path().string() + ": the arm moves during this run" +
      (frame == 0 ? formatted(" of {} frames", frames) : "") +
      ", and its angles are those of the first frame; use frame 1, or describe the C-arm yourself with the angles of " +
      (frame == 0 ? "another" : formatted("frame {}", frame)));
}

void check_frame(const DicomHeader& header, int frame, int frames) {
  if (frame <= frames) return;
  throw Error(formatted("{}: has {}; there is no frame {}", header.path().string(), counted(frames, "frame"), frame));
}

void check_angles(const DicomHeader& header, double primary_deg, double secondary_deg) {
  if (!(std::abs(primary_deg) <= 180))
    throw Error(
        formatted("{}: {} is {:f}, expected -180 to 180", header.path().string(), kPrimaryAngle.text(), primary_deg));
  if (!(std::abs(secondary_deg) <= 90))
    throw Error(
        formatted("{}: {} is {:f}, expected -90 to 90", header.path().string(), kSecondaryAngle.text(), secondary_deg));
}

void check_lengths(const DicomHeader& header, const CArm& arm) {
  const std::string what = header.path().string() + ": ";
  if (!(arm.source_to_isocentre_mm < arm.source_to_detector_mm))
    throw Error(formatted("{}the isocentre ({:f} mm from the source) lies behind the detector ({:f} mm)", what,
                          arm.source_to_isocentre_mm, arm.source_to_detector_mm));
  if (!(arm.source_to_detector_mm > 100 && arm.source_to_detector_mm < 5000))
    throw Error(formatted("{}{} is {:f} mm, which no C-arm has; give source_to_detector_mm", what,
                          kDistanceSourceToDetector.text(), arm.source_to_detector_mm));
  if (!(arm.pixel_mm.minCoeff() > 0.001 && arm.pixel_mm.maxCoeff() < 10))
    throw Error(formatted("{}a pixel of {:f} x {:f} mm is no detector's; give pixel_mm", what, arm.pixel_mm.x(),
                          arm.pixel_mm.y()));
}

/// Whether higher values mean less radiation. The header's sign refers to stored values; a negative slope or a table
/// that descends reverses it. Without a sign the image is taken as a viewer shows it: MONOCHROME1 shows its lowest
/// value white.
bool is_inverted(const DicomHeader& header, const DicomPixels& stored) {
  const auto sign = header.number(kIntensitySign);
  if (!sign) return header.text(kPhotometric).value_or("") == "MONOCHROME1";
  if (*sign != 1 && *sign != -1)
    throw Error(formatted("{}: {} is {}, expected 1 or -1", header.path().string(), kIntensitySign.text(), int(*sign)));
  return (*sign < 0) != (stored.table ? stored.table->descends() : stored.slope < 0);
}

/// Values must be linear in the radiation, because their logarithm is taken later. A table makes logarithms linear
/// (PS3.3 C.8.7.1.1.2).
void check_linear(const DicomHeader& header, const DicomPixels& stored) {
  if (header.text(kIntensity).value_or("") == "LOG" && !stored.table)
    throw Error(header.path().string() + ": its values are logarithms (" + kIntensity.text() +
                " is LOG) without the table that makes them linear (ModalityLUTSequence, or a "
                "PixelIntensityRelationshipLUTSequence whose LUTFunction is TO_LINEAR), but those of an X-ray image "
                "must rise linearly with the radiation; export it as linear (LIN), "
                "or, where only contours are looked for, save it as PNG or TIFF with bright air");
}

XrayGeometry geometry_of_frame(const DicomFile& file, int frame, const XrayOverrides& overrides) {
  const DicomHeader header(file, frame);
  XrayGeometry geometry;
  Wanted wanted(header);
  const double primary_deg = wanted.number(kPrimaryAngle, "or describe the C-arm yourself");
  const double secondary_deg = wanted.number(kSecondaryAngle, "or describe the C-arm yourself");
  CArm arm;
  arm.width_px = int(wanted.number(kColumns, ""));
  arm.height_px = int(wanted.number(kRows, ""));
  arm.source_to_detector_mm = overrides.source_to_detector_mm > 0
                                  ? overrides.source_to_detector_mm
                                  : wanted.number(kDistanceSourceToDetector, "or give source_to_detector_mm");
  arm.source_to_isocentre_mm =
      source_to_isocentre(header, arm.source_to_detector_mm, overrides.source_to_isocentre_mm, wanted);
  arm.pixel_mm = detector_pixel_mm(header, arm.source_to_detector_mm / arm.source_to_isocentre_mm, overrides.pixel_mm,
                                   wanted, geometry.warnings);
  wanted.finish();
  check_angles(header, primary_deg, secondary_deg);
  check_lengths(header, arm);
  Eigen::Matrix3d axes = carm_axes(secondary_deg, primary_deg);
  if (const auto stored = stored_axes(header, axes)) {
    axes.col(0) = stored->mirrored ? Eigen::Vector3d(-stored->right) : stored->right;
    axes.col(1) = stored->down;
  } else {
    geometry.warnings.push_back(file.path().string() + ": " + kPatientOrientation.text() +
                                " is missing, so the image is taken to have the head up and to be seen from the source "
                                "(in the frontal view the "
                                "patient's left is on the left); if it is not, mirror or turn it first");
  }
  if (const auto position = header.text(kPatientPosition); position && *position != "HFS")
    geometry.warnings.push_back(
        file.path().string() + ": " + kPatientPosition.text() + " is " + *position +
        "; angles are taken relative to the patient, as the standard has it, but not every C-arm writes them so");
  for (const DicomTag& tag : {kFieldOfViewOrigin, kIsocentreProjection}) {
    if (!header.has(tag)) continue;
    geometry.warnings.push_back(file.path().string() + ": " + tag.text() +
                                " is not used: the ray through the isocentre is taken to meet the image's "
                                "centre, which it does not where the image is a part of the detector; check the "
                                "camera with known points");
    break;  // once is enough
  }
  geometry.camera = carm_camera(arm, axes);
  check_camera(geometry.camera, file.path().string());
  return geometry;
}

/// Whether two frames were taken by the same camera.
bool are_same(const Camera& a, const Camera& b) {
  return a.intrinsics.isApprox(b.intrinsics, 1e-9) &&
         a.camera_from_world.rotation.isApprox(b.camera_from_world.rotation, 1e-9) &&
         a.camera_from_world.translation_mm.isApprox(b.camera_from_world.translation_mm, 1e-9);
}

/// If no frame is named, all frames must have the same camera. Throws Error otherwise.
void check_all_same(const DicomFile& file, int frames, const XrayGeometry& first, const XrayOverrides& overrides) {
  constexpr int kMostCompared = 1000, kMostShown = 8;
  if (frames == 1 || !find_element(file.path(), file.elements(), kFrameGroups)) return;
  bool same = frames <= kMostCompared;
  std::string shown;
  for (int frame = 1; frame <= std::min(frames, kMostCompared); ++frame) {
    same = same && are_same(geometry_of_frame(file, frame, overrides).camera, first.camera);
    if (frame > kMostShown) continue;
    const DicomHeader header(file, frame);
    const std::string text =
        formatted("{}frame {} at {:g}, {:g} degrees", frame == 1 ? "" : "; ", frame,
                  header.number(kPrimaryAngle).value_or(0), header.number(kSecondaryAngle).value_or(0));
    shown += text;
  }
  if (same) return;
  throw Error(
      formatted("{}: has {} frames with a geometry each ({}{}); name the one that the image is of with frame (from 1)",
                file.path().string(), frames, shown, frames > kMostShown ? "; ..." : ""));
}

}  // namespace

XrayGeometry read_xray_geometry(const std::filesystem::path& path, int frame, const XrayOverrides& overrides) {
  const DicomFile file(path);
  const int frames = read_dicom_pixels(file, std::max(1, frame)).frames;  // this also checks the header
  const DicomHeader header(file, std::max(1, frame));
  check_modality(header);
  check_motion(header, frame, frames);
  check_frame(header, frame, frames);
  XrayGeometry geometry = geometry_of_frame(file, std::max(1, frame), overrides);
  if (frame == 0) check_all_same(file, frames, geometry, overrides);
  return geometry;
}

XrayPixels read_xray_pixels(const std::filesystem::path& path, int frame) {
  const DicomFile file(path);
  const DicomHeader header(file, frame);
  XrayPixels pixels;
  const DicomPixels stored = read_dicom_pixels(file, frame);
  check_linear(header, stored);
  if (is_inverted(header, stored)) {
    constexpr int kMostBits = 24;  // which a float holds
    if (!stored.is_signed && stored.bits_stored > kMostBits)
      throw Error(
          formatted("{}: dark is air in this image of {} bits, and such pixels are inverted up to {} bits only; export "
                    "it with 16 bits",
                    path.string(), stored.bits_stored, kMostBits));
    pixels.inverted_from = sum_of_limits(stored);
  }
  const auto primary = header.number(kPrimaryAngle), secondary = header.number(kSecondaryAngle);
  if (primary && secondary)
    if (const auto stored = stored_axes(header, carm_axes(*secondary, *primary))) pixels.mirrored = stored->mirrored;
  return pixels;
}

}  // namespace marrow::files
