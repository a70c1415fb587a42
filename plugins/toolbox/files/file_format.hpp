// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a file holds. Devices name their files as they like (.IMA, IM000001), so the content decides, not the name.
#include <filesystem>
#include <string>

namespace marrow::files {

enum class FileFormat { unknown, png, tiff, jpeg, bmp, dicom, meta_image, nrrd, nifti };

/// The format by the file's first bytes or, if they belong to no known format, as in a damaged file, by its extension.
/// Throws Error as InputFile does; the file may be empty.
FileFormat file_format(const std::filesystem::path& path);

/// "a GIF picture": the name of a format that is not read, if the file's first bytes tell it; else empty.
std::string name_of_other_format(const std::filesystem::path& path);

}  // namespace marrow::files
