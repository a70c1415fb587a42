// SPDX-License-Identifier: Apache-2.0
#include "dicom_object.hpp"

#include "dicom_header.hpp"
#include "marrow/base/error.hpp"

namespace marrow::files {
namespace {

constexpr DicomTag kImageType{0x0008, 0x0008, "ImageType"};
constexpr DicomTag kSeriesDescription{0x0008, 0x103E, "SeriesDescription"};
constexpr DicomTag kSeries{0x0020, 0x000E, "SeriesInstanceUID"};

/// Whether the class is this one or a special kind of it.
bool is_class(const std::string& uid, const std::string& general) {
  return uid == general || uid.rfind(general + ".", 0) == 0;
}

/// A slice's header could be damaged, so more than its class must tell that it is none. Some programs write a CT as
/// secondary capture, or without a class.
std::string why_not_a_slice(const DicomHeader& header, const DicomObject& object) {
  const std::string& uid = object.class_uid;
  if (uid == "1.2.840.10008.1.3.10") return "a media directory";
  if (header.text(kImageType).value_or("").find("LOCALIZER") != std::string::npos) return "a localizer";
  if (uid.empty()) return object.modality.empty() && !header.has(kRows) && object.is_legible ? "no image" : "";
  if (is_class(uid, "1.2.840.10008.5.1.4.1.1.2")) return {};
  if (!object.is_legible) return is_class(uid, "1.2.840.10008.5.1.4.1.1.7") ? "" : "of the class " + uid;
  if (object.modality != "CT") return object.modality.empty() ? "of no modality" : object.modality;
  if (header.number(kSamplesPerPixel).value_or(1) > 1) return "in colours";
  if (!header.has(kImagePosition)) return "without a place in the patient";
  return {};
}

}  // namespace

DicomObject dicom_object(const std::filesystem::path& path) {
  const DicomFile file(path, DicomFile::Part::header);
  const DicomHeader header(file, 1);
  DicomObject object{path, file.media_class(), {}, {}, {}, {}, true};
  try {
    if (const auto given = header.text(kObjectClass)) object.class_uid = *given;
    object.series = header.text(kSeries).value_or("");
    object.description = header.text(kSeriesDescription).value_or("");
    object.modality = header.text(kModality).value_or("");
    object.is_legible = file.fault().empty() || !object.series.empty();
    object.not_a_slice = why_not_a_slice(header, object);
  } catch (const Error&) {  // an element that is damaged; reading the slice says so
    object.is_legible = false;
  }
  return object;
}

}  // namespace marrow::files
