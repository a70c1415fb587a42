// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the page "Place" keeps of a case in memory: its views, and the projectors and costs of each bone.
#include <optional>

#include "marrow/domain/functions.hpp"
#include "workbench/workbench.hpp"

namespace marrow::workbench {

/// One bone of an opened case.
struct PlacedBone {
  std::string name;
  std::shared_ptr<const RadiographProjector> radiograph;
  std::shared_ptr<const OutlineProjector> outline;
  std::shared_ptr<const Cost> contour, grey_values;  ///< coarser and faster than in a registration
  FragmentFrame frame;
  RigidTransform start;     ///< world_from_model to begin with
  std::string start_is;     ///< the source of `start`, in words
  double brightest_mm = 1;  ///< the line integral that is drawn brightest
};

/// An opened case. Nothing in it changes, so requests may use it at the same time.
struct PlacedCase {
  std::string path;
  List<View> views;
  std::vector<PlacedBone> bones;

  /// Both throw Error if the name is unknown.
  const View& view(const std::string& name) const;
  const PlacedBone& bone(const std::string& name) const;
};

/// Runs pipelines/workbench/place.yaml on a case of the opened folder.
std::shared_ptr<const PlacedCase> open_case(const std::string& path, const Workbench& workbench, Job& job);

/// The cases that were opened last. All methods may be called from several threads.
class PlacedCases {
 public:
  /// Keeps a case, and forgets all but the last two: each holds a CT.
  void keep(std::shared_ptr<const PlacedCase> one);
  /// Throws Conflict if it is no longer kept; the page then opens it again.
  std::shared_ptr<const PlacedCase> find(const std::string& path) const;

 private:
  mutable std::mutex mutex_;
  std::vector<std::shared_ptr<const PlacedCase>> cases_;
};

/// A placement of a request: a 4 x 4 matrix as rows. Throws Error unless it is a rigid motion.
RigidTransform placement_of(const nlohmann::json& matrix);

/// The image as 16 bit numbers, low byte first; each square of `step_px` pixels becomes its mean. Whole numbers stay as
/// they are. Others are spread from the least to the largest value of `like`, so that frames of a sequence are shown
/// alike. The page makes greys of them.
std::string number_bytes(const View& view, const View& like, int step_px);

/// The poses {BONE: matrix} of this name in a request. Throws Error unless each is a rigid motion.
std::map<std::string, RigidTransform> poses_in(const Request& request, const char* name = "poses");

/// The texts of pose files by their names: BONE.yaml for each bone. Throws Error if the pose of a bone is missing.
std::map<std::string, std::string> start_files(const PlacedCase& placed,
                                               const std::map<std::string, RigidTransform>& poses);
/// Writes files into a new folder `INTO/CASE/NUMBER` of the opened folder, and returns its relative path. If a folder
/// already holds the same files, uses that.
std::string write_placement(const OpenedFolder& folder, const std::string& into, const PlacedCase& placed,
                            const std::map<std::string, std::string>& texts);
/// Pipelines that register a case from its starts: [{file, name, help}], those of marrow first. `file` is relative to
/// the opened folder, or absolute.
nlohmann::json pipelines_from_starts(const Workbench& workbench);

/// The command that does what run_from_starts() does.
std::string command_from_starts(const Workbench& workbench, const std::string& pipeline, const std::string& case_path,
                                const std::string& starts);
/// Runs a pipeline on the case from these starts: {poses: {BONE: {matrix, deviations, warnings}}, verdicts: {BONE:
/// {...}}}.
nlohmann::json run_from_starts(const Workbench& workbench, const std::filesystem::path& pipeline,
                               const std::string& case_path, const std::string& starts, Job& job);

/// Add the requests about a sequence.
void add_place_frames(Server& server, Workbench& workbench, const std::shared_ptr<PlacedCases>& cases);
void add_place_tracking(Server& server, Workbench& workbench, const std::shared_ptr<PlacedCases>& cases);

}  // namespace marrow::workbench
