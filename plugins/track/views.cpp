// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/toolbox/track/track_state.hpp"

namespace {

marrow::List<marrow::View> views(const marrow::track::SequenceFrame& frame) {
  marrow::List<marrow::View> views;
  for (const marrow::View& view : frame.views) views.add(view.name, view);
  return views;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("track.views", views)
      .summary("The views of one frame of a sequence")
      .in("frame", "what all devices show at one moment")
      .out("views", "the views", marrow::over("view"));
}
