// SPDX-License-Identifier: Apache-2.0
// Keyframes of the page "Place", and the tracking of bones through a sequence. Keyframes are written as files, so that
// the command line can do the same.
#include <charconv>

#include "marrow/base/file_names.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/node/types.hpp"
#include "marrow/toolbox/files/atomic_write.hpp"
#include "marrow/toolbox/files/sequence_files.hpp"
#include "marrow/toolbox/files/yaml_text.hpp"
#include "marrow/toolbox/track/tra_file.hpp"
#include "workbench/place.hpp"
#include "workbench/xray.hpp"

namespace fs = std::filesystem;

namespace marrow::workbench {
namespace {

using nlohmann::json;
using track::AutoscoperTrack;
using track::Trajectory;

constexpr int kMostFrames = 1'000'000;

using track::SequenceFrame;

/// Where the frames of a view are.
struct ViewFrames {
  std::string name;
  std::string images;   ///< relative to the opened folder: a folder, a file with several frames, or a video
  std::string pattern;  ///< which files of the folder; empty: all images
};

/// A sequence, and the poses from which the bones are tracked through it.
struct TrackWish {
  std::vector<ViewFrames> views;
  double frame_rate_hz = 30;
  std::string placed;          ///< folder with BONE.yaml, relative to the opened folder
  bool has_keyframes = false;  ///< whether there are files BONE.tra in it
};

std::string text_in(const json& object, const char* name) {
  const auto found = object.find(name);
  return found != object.end() && found->is_string() ? found->get<std::string>() : "";
}

/// {VIEW: {images, pattern}} for each view of the case, in its order. Throws Error if one is missing.
std::vector<ViewFrames> frames_in(const json& views, const PlacedCase& placed) {
  std::vector<ViewFrames> all;
  for (std::size_t i = 0; i < placed.views.size(); ++i) {
    const std::string& name = placed.views.name(i);
    const auto found = views.is_object() ? views.find(name) : views.end();
    const json view = views.is_object() && found != views.end() ? *found : json::object();
    all.push_back({name, text_in(view, "images"), text_in(view, "pattern")});
    if (all.back().images.empty())
      throw Error("view " + in_quotes(printable(name)) +
                  ": say where its frames are: a folder of images, or a file with several frames");
  }
  return all;
}

/// The camera file of a view: the one that case.yaml names, or one with the camera in case.yaml.
fs::path camera_file_of(const Workbench& workbench, const PlacedCase& placed, const std::string& view) {
  const json document = document_of_case(workbench.folder, placed.path);
  for (const json& one : document.at("views"))
    if (one.at("name") == view) return camera_file(workbench, one.value("camera", json()), one.at("image"));
  throw Error("case.yaml has no view " + in_quotes(printable(view)) + " any more; open the case again");
}

/// Frames from `first` to `last` of a view; `last` 0: to the end.
List<SequenceFrame> read_frames(const Workbench& workbench, const PlacedCase& placed, const ViewFrames& view, int first,
                                int last, Job& job) {
  const auto one = [](const std::string& text) { return json::array({text}); };
  const NodeCall call{"read.sequence",
                      {{"names", one(view.name)},
                       {"images", one(workbench.folder.inside(view.images).string())},
                       {"patterns", one(view.pattern)},
                       {"cameras", one(camera_file_of(workbench, placed, view.name).string())},
                       {"first", first},
                       {"last", last}}};
  return outputs_of(call, workbench, job).at("frames").as_list<SequenceFrame>();
}

/// Some frames of a view as number_bytes(), one after the other; {frames, bytes}, the bytes of each.
Answer frames(const Workbench& workbench, const PlacedCase& placed, const Request& request) {
  constexpr int kMost = 1'000'000, kMostAtOnce = 32, kCoarsest_px = 16;
  ViewFrames view{placed.view(request.parameter("view")).name, request.parameter("images"),
                  request.parameter("pattern")};
  const int first = request.number("first", 1, kMost);
  const int last = request.number("last", first, first + kMostAtOnce - 1);
  const int step_px = request.number("step_px", 1, kCoarsest_px);
  Job job("", "");
  std::string bytes;
  const auto read = read_frames(workbench, placed, view, first, last, job);
  for (const SequenceFrame& frame : read) bytes += number_bytes(frame.views.front(), placed.view(view.name), step_px);
  const json about = {{"frames", read.size()}, {"bytes", bytes.size() / read.size()}};
  return bytes_answer(std::move(bytes), about);
}

/// The number of frames, which is the same in all views. Images of folders are not opened, except the first. Throws
/// Error if a view cannot be read, or if the views have different numbers of frames.
int count_frames(const Workbench& workbench, const PlacedCase& placed, const std::vector<ViewFrames>& views, Job& job) {
  std::vector<std::size_t> counts;
  for (const ViewFrames& view : views) {
    job.tell({{"event", "message"}, {"text", view.name}});
    const fs::path place = workbench.folder.inside(view.images);
    if (fs::is_directory(place)) {
      counts.push_back(files::frame_files(place, view.pattern).size());
      read_frames(workbench, placed, view, 1, 1, job);  // throws if the images cannot be read
    } else {
      counts.push_back(read_frames(workbench, placed, view, 1, 0, job).size());
    }
    if (counts.back() != counts.front())
      throw Error(formatted("view {} has {} frames, but view {} has {}; all views must show the same moments",
                            in_quotes(printable(view.name)), counts.back(), in_quotes(printable(views.front().name)),
                            counts.front()));
  }
  return int(counts.front());
}

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

/// Writes the poses in the first frame as BONE.yaml, and the keyframes {BONE: {FRAME from 1: matrix}} as BONE.tra, into
/// a folder as write_placement() does. So that other sequences have other folders, `sequence` is written beside them.
/// Returns the folder's path relative to the opened folder.
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

/// The command that does what track() does.
std::string command_to_track(const Workbench& workbench, const PlacedCase& placed, const TrackWish& wish) {
  return command_of(
      call_of(workbench, placed, wish, [](const std::string& path) { return path.empty() ? "." : path; }));
}

/// The poses that track() wrote, {BONE: [matrix or null]}. Throws Error if one cannot be read.
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

/// Follows the bones, and writes their poses as BONE.tra into the folder `tracked` of `wish.placed`. {tracked: its
/// path, poses: {BONE: [matrix or null of each frame]}, verdicts: {BONE: [judgement of each frame]}}
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

}  // namespace

void add_place_frames(Server& server, Workbench& workbench, const std::shared_ptr<PlacedCases>& cases) {
  server.post("/api/place/sequence", [&workbench, cases](const Request& request) {
    const auto placed = cases->find(request.text("case"));
    const auto views = frames_in(request.body.value("views", json()), *placed);
    for (const ViewFrames& view : views) workbench.folder.inside(view.images);
    const std::string job = workbench.jobs.start("Opening the sequence", "", [&workbench, placed, views](Job& running) {
      return json{{"frames", count_frames(workbench, *placed, views, running)}};
    });
    return json_answer({{"job", job}});
  });
  server.get("/api/place/frames", [&workbench, cases](const Request& request) {
    return frames(workbench, *cases->find(request.parameter("case")), request);
  });
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
