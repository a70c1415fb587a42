// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a file holds. Devices name their files as they like (.IMA, IM000001), so the content decides, not the name.
#include <filesystem>
#include <string>

namespace marrow::files {

enum class FileFormat { unknown, png, tiff, jpeg, bmp, dicom, meta_image, nrrd, nifti };

/// The format by the file's first bytes. If they are those of no known format, as in a damaged file, by the end of its
/// name. Throws Error as InputFile does; the file may be empty.
FileFormat file_format(const std::filesystem::path& path);

/// "a GIF picture": the format of a file that file_format() does not know, if its first bytes tell; else empty.
std::string name_of_other_format(const std::filesystem::path& path);

}  // namespace marrow::files
