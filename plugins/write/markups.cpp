// SPDX-License-Identifier: Apache-2.0
// Points for 3D Slicer, as .mrk.json. Coordinates are LPS, and the file says so.
#include <marrow/plugin.hpp>

#include "marrow/toolbox/exchange/markups.hpp"
#include "marrow/toolbox/exchange/written_files.hpp"

namespace {

using namespace marrow;
using exchange::MarkupsFile;

MarkupsFile markups(const Landmarks* landmarks, const Seeds* seeds) {
  if (!landmarks && !seeds) throw Error("the node that is wired to 'landmarks' or 'seeds' gave none");
  return {exchange::markups_json(landmarks ? exchange::marked_points(*landmarks) : exchange::marked_points(*seeds))};
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("write.markups", markups)
      .summary("Gives landmarks or seeds as points of 3D Slicer (.mrk.json)")
      .in("landmarks", "landmarks of one fragment; those seen in views and tracked ones are left out")
      .in("seeds", "seeds of one fragment; their labels are its name with a number")
      .out("markups", "a list of points in LPS, mm")
      .relation(exactly_one({"in.landmarks", "in.seeds"}));
  plugin.writer<MarkupsFile>(".mrk.json", exchange::write_file, "points of 3D Slicer in LPS");
}
