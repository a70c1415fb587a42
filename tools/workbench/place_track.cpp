// SPDX-License-Identifier: Apache-2.0
// Keyframes of the page "Place", and the tracking of bones through a sequence. Keyframes are written as files, so that
// the command line can do the same.
#include <charconv>

#include "marrow/base/error.hpp"
#include "marrow/base/file_names.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/node/types.hpp"
#include "marrow/toolbox/files/atomic_write.hpp"
#include "marrow/toolbox/files/yaml_text.hpp"
#include "marrow/toolbox/track/tra_file.hpp"
#include "workbench/place_sequence.hpp"
#include "workbench/xray.hpp"

namespace fs = std::filesystem;

namespace marrow::workbench {
namespace {

using nlohmann::json;
using track::AutoscoperTrack;
using track::Trajectory;

constexpr int kMostFrames = 1'000'000;

/// The poses {FRAME from 1: matrix} as a track with a line for each frame.
AutoscoperTrack track_of(const std::string& bone, const json& poses, int frames) {
  AutoscoperTrack track;
  track.world_from_bone.resize(std::size_t(frames));
  for (const auto& [text, matrix] : poses.items()) {
    int frame = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), frame);
    if (error != std::errc() || end != text.data() + text.size() || frame < 1 || frame > frames)
      throw Error(formatted("a keyframe of {} is in frame {}, but the sequence has frames 1 to {}; remove it",
                            in_quotes(printable(bone)), in_quotes(printable(text)), frames));
    track.world_from_bone[std::size_t(frame - 1)] = placement_of(matrix);
  }
  return track;
}

json poses_of(const AutoscoperTrack& track) {
  json poses = json::array();
  for (const auto& pose : track.world_from_bone) poses.push_back(pose ? workbench::json_of(*pose) : json());
  return poses;
}

/// `path` converts a path in the opened folder for this call.
template <class Path>
PipelineCall call_of(const Workbench& workbench, const PlacedCase& placed, const TrackWish& wish, const Path& path) {
  json names = json::array(), images = json::array(), patterns = json::array(), cameras = json::array();
  for (const ViewFrames& view : wish.views) {
    names.push_back(view.name);
    images.push_back(path(view.images));
    patterns.push_back(view.pattern);
    cameras.push_back(path(workbench.folder.relative(camera_file_of(workbench, placed, view.name))));
  }
  PipelineCall call{workbench_pipeline("track")};
  call.arguments.inputs = {
      {"case", path(placed.path)}, {"starts", path(wish.placed)}, {"frame_rate_hz", files::number(wish.frame_rate_hz)}};
  if (wish.has_keyframes) call.arguments.inputs.push_back({"keyframes", path(wish.placed)});
  call.arguments.overrides = {{"sequence.names", set_text(names)},
                              {"sequence.images", set_text(images)},
                              {"sequence.patterns", set_text(patterns)},
                              {"sequence.cameras", set_text(cameras)}};
  return call;
}

TrackWish wish_of(const Request& request, const Workbench& workbench, const PlacedCase& placed) {
  TrackWish wish;
  wish.views = frames_in(request.body.value("views", json()), placed);
  for (const ViewFrames& view : wish.views) workbench.folder.inside(view.images);
  const json rate = request.body.value("frame_rate_hz", json());
  if (!rate.is_number() || !(rate.get<double>() > 0)) throw Error("the frame rate must be a number above 0");
  wish.frame_rate_hz = rate.get<double>();
  return wish;
}

/// Writes the poses of a request, and enters their folder into `wish`.
void write_poses(const Request& request, const Workbench& workbench, const PlacedCase& placed, TrackWish& wish) {
  const json frames = request.body.value("frames", json());
  if (!frames.is_number_integer() || frames < 1 || frames > kMostFrames)
    throw Error(formatted("'frames' must be a whole number from 1 to {}", kMostFrames));
  const json keyframes = request.body.value("keyframes", json::object());
  wish.placed = write_keyframes(
      workbench.folder, placed, poses_in(request, "starts"), keyframes, frames.get<int>(),
      {{"frame_rate_hz", request.body.value("frame_rate_hz", json())}, {"views", request.body.value("views", json())}});
  for (const auto& [bone, poses] : keyframes.items()) wish.has_keyframes = wish.has_keyframes || !poses.empty();
}

}  // namespace

std::string write_keyframes(const OpenedFolder& folder, const PlacedCase& placed,
                            const std::map<std::string, RigidTransform>& starts, const json& keyframes, int frames,
                            const json& sequence) {
  std::map<std::string, std::string> texts = start_files(placed, starts);
  if (!keyframes.is_object()) throw Error("the request lacks 'keyframes', an object");
  for (const auto& [bone, poses] : keyframes.items())
    if (!poses.empty())
      texts[file_name_of(placed.bone(bone).name) + ".tra"] = track::tra_text(track_of(bone, poses, frames));
  texts["sequence.json"] = sequence.dump(1) + "\n";
  return write_placement(folder, "placed", placed, texts);
}

std::string command_to_track(const Workbench& workbench, const PlacedCase& placed, const TrackWish& wish) {
  return command_of(
      call_of(workbench, placed, wish, [](const std::string& path) { return path.empty() ? "." : path; }));
}

json track(const Workbench& workbench, const PlacedCase& placed, const TrackWish& wish, Job& job) {
  const PipelineCall call =
      call_of(workbench, placed, wish, [&](const std::string& path) { return workbench.folder.inside(path).string(); });
  const std::map<std::string, Value> made = outputs_of(call, workbench, job);
  const auto tracks = made.at("tra").as_list<AutoscoperTrack>();
  const auto ways = made.at("way").as_list<Trajectory>();
  const std::string tracked = wish.placed + "/tracked";
  fs::create_directories(workbench.folder.inside(tracked));
  json verdicts = json::object();
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const std::string& bone = tracks.name(i);
    files::write_text(workbench.folder.inside(tracked) / (file_name_of(bone) + ".tra"), track::tra_text(tracks[i]));
    for (const Verdict& verdict : ways[i].verdicts) verdicts[bone].push_back(name_of(verdict.judgement));
  }
  // The poses are read back, so that they have the same digits as when they are read again later.
  return {{"tracked", tracked}, {"poses", tracked_poses(workbench.folder, placed, tracked)}, {"verdicts", verdicts}};
}

json tracked_poses(const OpenedFolder& folder, const PlacedCase& placed, const std::string& tracked) {
  json poses = json::object();
  const fs::path place = folder.inside(tracked);
  for (const PlacedBone& bone : placed.bones) {
    const fs::path file = place / (file_name_of(bone.name) + ".tra");
    if (fs::exists(file)) poses[bone.name] = poses_of(track::read_tra_file(file));
  }
  if (poses.empty()) throw Error(in_quotes(printable(tracked)) + ": the tracked poses are gone; track the bones again");
  return poses;
}

void add_place_tracking(Server& server, Workbench& workbench, const std::shared_ptr<PlacedCases>& cases) {
  server.post("/api/place/keyframes", [&workbench, cases](const Request& request) {
    const auto placed = cases->find(request.text("case"));
    TrackWish wish;
    write_poses(request, workbench, *placed, wish);
    return json_answer({{"folder", wish.placed}});
  });
  server.post("/api/place/track", [&workbench, cases](const Request& request) {
    const auto placed = cases->find(request.text("case"));
    TrackWish wish = wish_of(request, workbench, *placed);
    write_poses(request, workbench, *placed, wish);
    const std::string command = command_to_track(workbench, *placed, wish);
    const std::string job = workbench.jobs.start("Tracking", command, [&workbench, placed, wish](Job& running) {
      return track(workbench, *placed, wish, running);
    });
    return json_answer({{"job", job}, {"command", command}});
  });
  server.get("/api/place/tracked", [&workbench, cases](const Request& request) {
    const auto placed = cases->find(request.parameter("case"));
    return json_answer(tracked_poses(workbench.folder, *placed, request.parameter("folder")));
  });
}

}  // namespace marrow::workbench
