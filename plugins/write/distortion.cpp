// SPDX-License-Identifier: Apache-2.0
// Writes a distortion and the points from which it was measured.
#include <marrow/plugin.hpp>

#include "marrow/toolbox/files/atomic_write.hpp"
#include "marrow/toolbox/files/camera_file.hpp"
#include "marrow/toolbox/files/yaml_text.hpp"

namespace {

using marrow::files::number;

void distortion(const marrow::distortion::Distortion& distortion, const std::string& path) {
  check_distortion(distortion, path);
  marrow::files::write_text(path, marrow::files::distortion_text(distortion));
}

/// A table that programs for tables open.
void plate_points(const marrow::distortion::PlatePoints& points, const std::string& path) {
  std::string text = "ideal_u_px,ideal_v_px,seen_u_px,seen_v_px,used\n";
  for (std::size_t i = 0; i < points.used.size(); ++i)
    text += marrow::formatted("{},{},{},{},{}\n", number(points.ideal_px[i].x()), number(points.ideal_px[i].y()),
                              number(points.seen_px[i].x()), number(points.seen_px[i].y()), int(points.used[i]));
  marrow::files::write_text(path, text);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.writer<marrow::distortion::Distortion>(".yaml", distortion, "distortion with its terms and measured area");
  plugin.writer<marrow::distortion::PlatePoints>(".csv", plate_points,
                                                 "where a straight image shows each point, and where it was seen");
}
