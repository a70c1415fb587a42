// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the nodes `write.*` give: the bytes of a file in another program's format. A type for each ending, because a run
// writes an output by its type.
#include <string>

#include "marrow/runtime/node/value.hpp"
#include "marrow/toolbox/files/atomic_write.hpp"

namespace marrow::exchange {

/// The content of a file. `Format` only tells the types apart.
template <class Format>
struct FileOf {
  std::string bytes;
  using fields = Fields<&FileOf::bytes>;
};

using MarkupsFile = FileOf<struct Markups>;
using FcsvFile = FileOf<struct Fcsv>;
using ItkTransformFile = FileOf<struct ItkTransform>;
using ObjFile = FileOf<struct Obj>;
using VtpFile = FileOf<struct Vtp>;
using PlastimatchFile = FileOf<struct Plastimatch>;
using RtkFile = FileOf<struct Rtk>;
using XregFile = FileOf<struct Xreg>;
using XmalabCameraFile = FileOf<struct XmalabCamera>;
using XmalabGridFile = FileOf<struct XmalabGrid>;
using JtsFile = FileOf<struct Jts>;
using JtakFile = FileOf<struct Jtak>;
using JointTrackCameraFile = FileOf<struct JointTrackCamera>;

/// The writer of such a type.
template <class Format>
void write_file(const FileOf<Format>& file, const std::string& path) {
  files::write_text(path, file.bytes);
}

}  // namespace marrow::exchange

MARROW_VALUE_TYPE(marrow::exchange::MarkupsFile, "markups_file", 1)
MARROW_VALUE_TYPE(marrow::exchange::FcsvFile, "fcsv_file", 1)
MARROW_VALUE_TYPE(marrow::exchange::ItkTransformFile, "itk_transform_file", 1)
MARROW_VALUE_TYPE(marrow::exchange::ObjFile, "obj_file", 1)
MARROW_VALUE_TYPE(marrow::exchange::VtpFile, "vtp_file", 1)
MARROW_VALUE_TYPE(marrow::exchange::PlastimatchFile, "plastimatch_file", 1)
MARROW_VALUE_TYPE(marrow::exchange::RtkFile, "rtk_file", 1)
MARROW_VALUE_TYPE(marrow::exchange::XregFile, "xreg_file", 1)
MARROW_VALUE_TYPE(marrow::exchange::XmalabCameraFile, "xmalab_camera_file", 1)
MARROW_VALUE_TYPE(marrow::exchange::XmalabGridFile, "xmalab_grid_file", 1)
MARROW_VALUE_TYPE(marrow::exchange::JtsFile, "jts_file", 1)
MARROW_VALUE_TYPE(marrow::exchange::JtakFile, "jtak_file", 1)
MARROW_VALUE_TYPE(marrow::exchange::JointTrackCameraFile, "jointtrack_camera_file", 1)
