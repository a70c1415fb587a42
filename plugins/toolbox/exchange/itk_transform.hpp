// SPDX-License-Identifier: Apache-2.0
#pragma once
// Rigid motions in the text files of ITK and 3D Slicer (.tfm).
#include <filesystem>
#include <string>

#include "marrow/domain/transform.hpp"

namespace marrow::exchange {

/// Whether the extension is that of ITK's transforms: .tfm or .txt, in small or capital letters.
bool is_itk_transform_file(const std::filesystem::path& path);

/// The motion x -> R x + t, in mm and LPS, that the file holds, with its centre of rotation included. Its frames are
/// named `target` and `source` by the caller, because the file does not say what it maps. It may be an AffineTransform,
/// MatrixOffsetTransformBase, VersorRigid3DTransform or Euler3DTransform in three dimensions. Throws Error for other
/// types, several transforms, a damaged file, and a matrix that scales, shears or mirrors.
RigidTransform read_itk_transform(const std::filesystem::path& path, const std::string& target,
                                  const std::string& source);

/// A whole .tfm file with one AffineTransform_double_3_3. Reading gives exactly the same numbers.
std::string itk_transform(const RigidTransform& transform);

}  // namespace marrow::exchange
