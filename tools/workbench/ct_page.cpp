// SPDX-License-Identifier: Apache-2.0
// The requests of the page "Case" about its CT: reading it, and its slices.
#include <unistd.h>
#include <algorithm>
#include <cmath>

#include "marrow/base/json_text.hpp"
#include "marrow/base/printable.hpp"
#include "workbench/ct.hpp"

namespace fs = std::filesystem;

namespace marrow::workbench {
namespace {

using nlohmann::json;

/// The options of a CT that a case may give beside its file.
constexpr const char* kOptions[] = {"voxel_size_mm", "flip", "value_offset_hu", "series_uid"};

NodeCall call_of(const fs::path& place, const json& ct) {
  NodeCall call{"read.volume", {{"path", place.string()}}};
  for (const char* option : kOptions)
    if (ct.contains(option)) call.options.emplace_back(option, ct[option]);
  return call;
}

/// Reads it unless it is in memory already.
std::shared_ptr<const OpenCt> opened(const fs::path& place, const json& ct, Workbench& workbench, CtMemory& memory,
                                     Job& job) {
  std::unique_lock reading(memory.reading(), std::defer_lock);
  while (!reading.try_lock_for(std::chrono::milliseconds(100)))
    if (job.stopped()) throw Error("stopped");
  const FilesOfCt files(place);
  const std::string content = content_of_ct(place, ct, files);
  if (auto known = memory.by_content(content)) return known;
  memory.check_size(files.bytes);
  auto outputs = outputs_of(call_of(place, ct), workbench, job);
  return memory.add(content, std::move(outputs.at("volume")));
}

std::string gigabytes(std::uintmax_t bytes) { return formatted("{:.1f} GB", double(bytes) / 1e9); }

/// The largest angle between an axis of the grid and the patient's axis next to it.
double obliquity_deg(const Grid& grid) {
  double largest_deg = 0;
  for (int k = 0; k < 3; ++k) {
    const double cosine = std::min(1.0, grid.direction.col(k).cwiseAbs().maxCoeff());
    largest_deg = std::max(largest_deg, std::acos(cosine) * 180 / M_PI);
  }
  return largest_deg;
}

std::int16_t as_int16(float value) { return std::int16_t(std::lround(std::clamp(value, -32768.0f, 32767.0f))); }

/// Reasons to doubt that a volume is a CT, as sentences for people.
std::vector<std::string> doubts_about(const OpenCt& ct) {
  constexpr float kAir_hu = -500;
  constexpr int kFewSlices = 16;
  constexpr double kOblique_deg = 1, kThick = 4;
  const Grid& grid = ct.volume().grid;
  std::vector<std::string> doubts;
  if (ct.lowest_hu > kAir_hu)
    doubts.push_back(formatted(
        "No value is below -500 HU (the lowest is {:.0f}), but air is near -1000 HU. Is this a CT? If its file "
        "holds HU + 1024, give the offset -1024.",
        double(ct.lowest_hu)));
  if (const double angle_deg = obliquity_deg(grid); angle_deg > kOblique_deg)
    doubts.push_back(formatted(
        "The axes of its grid are turned by {:.0f} degrees from the patient's. The slices follow the grid, so "
        "they are oblique.",
        angle_deg));
  const int fewest = *std::min_element(grid.size.begin(), grid.size.end());
  if (fewest < kFewSlices)
    doubts.push_back(
        formatted("It has only {} slices along one of its axes. Are files of the series missing?", fewest));
  if (const double thick = grid.spacing_mm.maxCoeff(), thin = grid.spacing_mm.minCoeff(); thick > kThick * thin)
    doubts.push_back(
        formatted("Its voxels are {:.3g} mm long and {:.3g} mm wide, so the bone's surface is not well known along the "
                  "longer side.",
                  thick, thin));
  return doubts;
}

/// POST /api/ct/open, GET /api/ct/slice
void add_ct_reading(Server& server, Workbench& workbench, const std::shared_ptr<CtMemory>& memory) {
  server.post("/api/ct/open", [&workbench, memory](const Request& request) {
    json ct = request.body.value("ct", json());
    if (!ct.is_object() || !ct.contains("file") || !ct["file"].is_string())
      throw Error("the request names no file of a CT");
    const std::string file = ct["file"];
    const fs::path place = workbench.folder.inside(file);
    const std::string job = workbench.jobs.start(
        "Reading the CT", command_of(call_of(file, ct)),
        [&workbench, memory, place, ct](Job& job) { return about_ct(*opened(place, ct, workbench, *memory, job)); });
    return json_answer({{"job", job}, {"command", command_of(call_of(file, ct))}});
  });
  server.get("/api/ct/slice", [memory](const Request& request) {
    const auto ct = memory->by_name(request.parameter("ct"));
    const int axis = request.number("axis", 0, 2);
    return bytes_answer(
        slice_of(ct->volume(), axis, request.number("index", 0, ct->volume().grid.size[std::size_t(axis)] - 1)));
  });
}

}  // namespace

void add_ct_page(Server& server, Workbench& workbench) {
  const auto memory = std::make_shared<CtMemory>();
  add_ct_reading(server, workbench, memory);
  add_label_reading(server, workbench, memory);
  add_segmenting(server, workbench, memory);
  add_saving(server, workbench, memory);
}

FilesOfCt::FilesOfCt(const fs::path& place) {
  constexpr std::size_t kMostSlices = 20'000;  // files of a series
  std::error_code error;
  if (!fs::exists(place, error)) throw Error(printable(place.string()) + ": there is no such file or folder");
  if (!fs::is_directory(place, error)) {
    add(place);
    return;
  }
  std::size_t count = 0;
  for (fs::recursive_directory_iterator entry(place, error), end; !error && entry != end; entry.increment(error)) {
    if (++count > kMostSlices)
      throw Error(formatted("{}: this folder holds more than {} files; choose the folder of one series",
                            printable(place.string()), kMostSlices));
    std::error_code none;
    if (entry->is_regular_file(none)) add(entry->path());
  }
  if (error) throw Error(printable(place.string()) + ": this folder cannot be read: " + error.message());
}

void FilesOfCt::add(const fs::path& file) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(file, error);
  if (error) return;  // the reader of the CT reports it
  bytes += size;
  const auto time = fs::last_write_time(file, error).time_since_epoch().count();
  description += formatted("{} {} {}\n", file.filename().string(), size, time);
}

std::string content_of_ct(const fs::path& place, nlohmann::json ct, const FilesOfCt& files) {
  ct.erase("file");
  return place.string() + '\n' + json_text(ct) + '\n' + files.description;
}

std::uintmax_t most_ct_bytes() {
  const auto memory = std::uintmax_t(sysconf(_SC_PHYS_PAGES)) * std::uintmax_t(sysconf(_SC_PAGESIZE));
  return std::min<std::uintmax_t>(3'000'000'000, memory / 2);
}

void CtMemory::check_size(std::uintmax_t file_bytes) const {
  const std::uintmax_t needed = 2 * file_bytes;  // samples of 16 bits become samples of 32
  if (needed > most_bytes_)
    throw Error("this CT would take about " + gigabytes(needed) + " of memory, and at most " + gigabytes(most_bytes_) +
                " are used for CTs here; cut it to the bone, or store it with larger voxels");
}

std::list<CtMemory::Entry>::iterator CtMemory::find(const std::string& content) {
  return std::find_if(open_.begin(), open_.end(), [&](const Entry& entry) {
    return std::find(entry.contents.begin(), entry.contents.end(), content) != entry.contents.end();
  });
}

std::shared_ptr<const OpenCt> CtMemory::used(std::list<Entry>::iterator entry) {
  open_.splice(open_.begin(), open_, entry);
  return open_.front().ct;
}

std::shared_ptr<const OpenCt> CtMemory::by_content(const std::string& content) {
  const std::lock_guard lock(mutex_);
  const auto found = find(content);
  return found == open_.end() ? nullptr : used(found);
}

std::shared_ptr<const OpenCt> CtMemory::by_name(const std::string& name) {
  const std::lock_guard lock(mutex_);
  const auto found =
      std::find_if(open_.begin(), open_.end(), [&](const Entry& entry) { return entry.ct->name == name; });
  if (found == open_.end()) throw Conflict("this CT is no longer in memory; it is opened again");
  return used(found);
}

void CtMemory::add_copy(const std::string& content, const std::string& same) {
  const std::lock_guard lock(mutex_);
  const auto found = find(content);
  if (found != open_.end()) found->contents.push_back(same);
}

std::shared_ptr<const OpenCt> CtMemory::add(const std::string& content, Value value) {
  const auto ct = std::make_shared<OpenCt>();
  ct->value = std::move(value);
  if (ct->bytes() > most_bytes_)
    throw Error("this CT takes " + gigabytes(ct->bytes()) + " of memory, and at most " + gigabytes(most_bytes_) +
                " are used for CTs here; cut it to the bone, or store it with larger voxels");
  const auto [lowest, highest] = std::minmax_element(ct->volume().values.begin(), ct->volume().values.end());
  ct->lowest_hu = *lowest;
  ct->highest_hu = *highest;
  const std::lock_guard lock(mutex_);
  ct->name = formatted("ct-{}", ++count_);
  open_.push_front({{content}, ct});
  std::uintmax_t bytes = 0;
  for (auto one = open_.begin(); one != open_.end();) {
    bytes += one->ct->bytes();
    one = bytes > most_bytes_ ? open_.erase(one) : std::next(one);
  }
  return ct;
}

json about_ct(const OpenCt& ct) {
  const Grid& grid = ct.volume().grid;
  json direction = json::array();
  for (int row = 0; row < 3; ++row) direction.push_back(json_of(Eigen::Vector3d(grid.direction.row(row))));
  return {{"name", ct.name},
          {"size", grid.size},
          {"spacing_mm", json_of(grid.spacing_mm)},
          {"origin_mm", json_of(grid.origin_mm)},
          {"direction", direction},
          {"lowest_hu", ct.lowest_hu},
          {"highest_hu", ct.highest_hu},
          {"doubts", doubts_about(ct)}};
}

std::string slice_of(const Volume& volume, int axis, int index) {
  const Grid& grid = volume.grid;
  const int fast = axis == 0 ? 1 : 0, slow = axis == 2 ? 1 : 2;
  const std::array<std::size_t, 3> step = {1, std::size_t(grid.size[0]),
                                           std::size_t(grid.size[0]) * std::size_t(grid.size[1])};
  std::string bytes(std::size_t(grid.size[fast]) * std::size_t(grid.size[slow]) * sizeof(std::int16_t), '\0');
  auto* out = reinterpret_cast<std::int16_t*>(bytes.data());
  for (int b = 0; b < grid.size[slow]; ++b) {
    const float* from = volume.values.data() + std::size_t(index) * step[axis] + std::size_t(b) * step[slow];
    for (int a = 0; a < grid.size[fast]; ++a, from += step[fast]) *out++ = as_int16(*from);
  }
  return bytes;
}

}  // namespace marrow::workbench
