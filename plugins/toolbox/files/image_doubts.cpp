// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/files/image_doubts.hpp"

#include <algorithm>

#include "marrow/toolbox/files/dicom_header.hpp"
#include "marrow/toolbox/files/file_format.hpp"

namespace marrow::files {
namespace {

constexpr DicomTag kLossy{0x0028, 0x2110, "LossyImageCompression"};

/// Headers of copies forget that their pixels were compressed, so the way they are written now counts too.
bool is_lossy_dicom(const std::filesystem::path& path) {
  constexpr const char* kLossySyntaxes[] = {"1.2.840.10008.1.2.4.50", "1.2.840.10008.1.2.4.51",
                                            "1.2.840.10008.1.2.4.81", "1.2.840.10008.1.2.4.91"};
  const DicomFile file(path);
  return std::find(std::begin(kLossySyntaxes), std::end(kLossySyntaxes), file.transfer_syntax()) !=
             std::end(kLossySyntaxes) ||
         DicomHeader(file, 1).text(kLossy).value_or("") == "01";
}

}  // namespace

bool is_lossy_image(const std::filesystem::path& image) {
  const FileFormat format = file_format(image);
  return format == FileFormat::jpeg || (format == FileFormat::dicom && is_lossy_dicom(image));
}

void warn_of_pixels(const std::filesystem::path& image, const Context& context) {
  if (is_lossy_image(image))
    context.warn(image.string() +
                 ": was compressed with loss (JPEG or the like): grey levels are changed a little, most where edges "
                 "are, and may have lost bits; use the device's own file where there is one");
  if (file_format(image) == FileFormat::nifti)
    context.warn(image.string() +
                 ": NIfTI does not say which row of an image is the upper one; the first that is stored is taken as "
                 "the upper one, as ITK writes it: compare it with the anatomy, or save it as PNG");
}

}  // namespace marrow::files
