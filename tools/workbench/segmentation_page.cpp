// SPDX-License-Identifier: Apache-2.0
// The requests of the page "Case" about segmenting: a job that segments, first on a coarse grid, then on that of the
// CT; the outlines in the slices; the surfaces.
#include <algorithm>
#include <array>
#include <cmath>
#include <deque>

#include "marrow/base/printable.hpp"
#include "marrow/domain/case.hpp"
#include "workbench/ct.hpp"

namespace marrow::workbench {
namespace {

using nlohmann::json;

// What the page "Case" shows of a segmentation: its outlines in the slices of the CT.

/// Along one axis: index in the CT = first + step * index in the field.
struct AxisOfField {
  double first = 0, step = 1;
};

AxisOfField axis_of(const SignedField& field, const Grid& ct, int k) {
  const double shift_mm = ct.direction.col(k).dot(field.grid.origin_mm - ct.origin_mm);
  return {shift_mm / ct.spacing_mm[k], field.grid.spacing_mm[k] / ct.spacing_mm[k]};
}

/// The field in a plane between two of its slices.
std::vector<float> plane_of(const SignedField& field, int axis, double at) {
  const Grid& grid = field.grid;
  const int fast = axis == 0 ? 1 : 0, slow = axis == 2 ? 1 : 2, last = grid.size[std::size_t(axis)] - 1;
  const double clamped = std::clamp(at, 0.0, double(last));
  const int below = std::min(int(clamped), std::max(0, last - 1)), above = std::min(below + 1, last);
  const float part = float(clamped - below);
  std::vector<float> plane;
  plane.reserve(std::size_t(grid.size[std::size_t(fast)]) * std::size_t(grid.size[std::size_t(slow)]));
  std::array<int, 3> index{};
  for (int b = 0; b < grid.size[std::size_t(slow)]; ++b)
    for (int a = 0; a < grid.size[std::size_t(fast)]; ++a) {
      index[std::size_t(fast)] = a;
      index[std::size_t(slow)] = b;
      index[std::size_t(axis)] = below;
      const float low = field.at(index[0], index[1], index[2]);
      index[std::size_t(axis)] = above;
      plane.push_back(low + part * (field.at(index[0], index[1], index[2]) - low));
    }
  return plane;
}

/// How many voxels along each axis become one, so that about `most_voxels` are left; 1, 1, 1 if there are no more than
/// that.
std::array<int, 3> coarse_steps(const Grid& grid, double most_voxels) {
  const Eigen::Vector3d size_mm =
      grid.spacing_mm.cwiseProduct(Eigen::Vector3d(grid.size[0], grid.size[1], grid.size[2]));
  const double side_mm = std::cbrt(size_mm.prod() / most_voxels);
  std::array<int, 3> step{1, 1, 1};
  if (double(grid.count()) > most_voxels)
    for (std::size_t k = 0; k < 3; ++k)
      step[k] = std::clamp(int(std::ceil(side_mm / grid.spacing_mm[Eigen::Index(k)])), 1, grid.size[k]);
  return step;
}

/// Means of blocks of step[0] x step[1] x step[2] voxels.
Volume coarser(const Volume& volume, const std::array<int, 3>& step) {
  Volume result;
  result.grid = volume.grid;
  Eigen::Vector3d first;
  for (std::size_t k = 0; k < 3; ++k) {
    result.grid.size[k] = (volume.grid.size[k] + step[k] - 1) / step[k];
    result.grid.spacing_mm[Eigen::Index(k)] *= step[k];
    first[Eigen::Index(k)] = 0.5 * (step[k] - 1);
  }
  result.grid.origin_mm = volume.grid.point_from_index(first);
  std::vector<double> sums(result.grid.count());
  std::vector<int> counts(result.grid.count());
  const float* value = volume.values.data();
  for (int z = 0; z < volume.grid.size[2]; ++z)
    for (int y = 0; y < volume.grid.size[1]; ++y) {
      const std::size_t row = result.grid.offset(0, y / step[1], z / step[2]);
      for (int x = 0; x < volume.grid.size[0]; ++x, ++value) {
        sums[row + std::size_t(x / step[0])] += *value;
        ++counts[row + std::size_t(x / step[0])];
      }
    }
  result.values.resize(sums.size());
  for (std::size_t i = 0; i < sums.size(); ++i) result.values[i] = float(sums[i] / counts[i]);
  return result;
}

/// The zero line of the field in a slice perpendicular to an axis of the CT's grid: both ends of each segment, in
/// indices of the CT's other two axes, the lower one first. The field's grid has the CT's axes, but may be coarser.
std::vector<float> outline_in_slice(const SignedField& field, const Grid& ct, int axis, int index) {
  const int fast = axis == 0 ? 1 : 0, slow = axis == 2 ? 1 : 2;
  const AxisOfField across = axis_of(field, ct, axis), along = axis_of(field, ct, fast), up = axis_of(field, ct, slow);
  const std::vector<float> plane = plane_of(field, axis, (index - across.first) / across.step);
  const int width = field.grid.size[std::size_t(fast)], height = field.grid.size[std::size_t(slow)];
  std::vector<float> ends;
  for (int b = 0; b + 1 < height; ++b)
    for (int a = 0; a + 1 < width; ++a) {
      // The corners of a square in turn; where the sign changes along a side, the outline crosses it.
      const float corner[4] = {plane[std::size_t(b * width + a)], plane[std::size_t(b * width + a + 1)],
                               plane[std::size_t((b + 1) * width + a + 1)], plane[std::size_t((b + 1) * width + a)]};
      static constexpr double kPlace[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
      float crossings[8];
      int count = 0;
      for (int k = 0; k < 4; ++k) {
        const float from = corner[k], to = corner[(k + 1) % 4];
        if ((from < 0) == (to < 0)) continue;
        const double part = double(from) / (double(from) - double(to));
        const auto at = [&](int i) { return kPlace[k][i] + part * (kPlace[(k + 1) % 4][i] - kPlace[k][i]); };
        crossings[count++] = float(along.first + along.step * (a + at(0)));
        crossings[count++] = float(up.first + up.step * (b + at(1)));
      }
      if (count == 4) ends.insert(ends.end(), crossings, crossings + 4);
      if (count != 8) continue;
      // A saddle: the mean says whether the two corners of the first sign are joined.
      const bool is_joined = (corner[0] + corner[1] + corner[2] + corner[3] < 0) == (corner[0] < 0);
      const int first = is_joined ? 0 : 6, second = is_joined ? 2 : 0;
      for (const int from : {first, second, is_joined ? 4 : 2, is_joined ? 6 : 4})
        ends.insert(ends.end(), {crossings[from], crossings[from + 1]});
    }
  return ends;
}

constexpr double kCoarseVoxels = 1.5e6;                   // a level set of two fragments on it takes seconds
constexpr std::uintmax_t kMostStoredBytes = 200'000'000;  // of fields that are kept for a later `marrow run`
constexpr std::size_t kMostKept = 2;                      // segmentations in memory
constexpr std::array<int, 3> kEachVoxel{1, 1, 1};

struct Segmentation {
  std::shared_ptr<const OpenCt> ct;  ///< nullptr if the case has none
  List<SignedField> fields;
  List<Mesh> surfaces;
};

/// The newest segmentations, by name. A finer result replaces the coarser one of the same name.
class Segmentations {
 public:
  std::string new_name() {
    const std::lock_guard lock(mutex_);
    return formatted("segmentation-{}", ++count_);
  }
  void keep(const std::string& name, std::shared_ptr<const Segmentation> segmentation) {
    const std::lock_guard lock(mutex_);
    std::erase_if(kept_, [&](const auto& one) { return one.first == name; });
    kept_.emplace_back(name, std::move(segmentation));
    while (kept_.size() > 1 && (kept_.size() > kMostKept || bytes() > most_ct_bytes())) kept_.pop_front();
  }
  std::shared_ptr<const Segmentation> find(const std::string& name) {
    const std::lock_guard lock(mutex_);
    for (const auto& [known, segmentation] : kept_)
      if (known == name) return segmentation;
    throw Conflict("this segmentation is no longer in memory; segment again");
  }

 private:
  std::uintmax_t bytes() const {
    std::uintmax_t sum = 0;
    for (const auto& [name, segmentation] : kept_)
      for (const SignedField& field : segmentation->fields) sum += field.values_mm.size() * sizeof(float);
    return sum;
  }

  std::mutex mutex_;
  std::deque<std::pair<std::string, std::shared_ptr<const Segmentation>>> kept_;
  int count_ = 0;
};

List<Seeds> seeds_of(const json& fragments) {
  List<Seeds> seeds;
  for (const auto& [name, fragment] : fragments.items()) {
    Seeds one;
    one.fragment = name;
    for (const json& point : fragment.value("seeds", json::array()))
      one.points_mm.emplace_back(point.at(0).get<double>(), point.at(1).get<double>(), point.at(2).get<double>());
    if (one.points_mm.empty())
      throw Error("fragment " + in_quotes(printable(name)) + " has no seed; click inside its bone first");
    one.wanted = fragment.value("register", true);
    seeds.add(name, std::move(one));
  }
  if (seeds.empty()) throw Error("there is no fragment; add one, with seeds inside its bone");
  return seeds;
}

struct Order {
  std::string pipeline;  ///< of pipelines/workbench
  std::string threshold_hu;
  List<Seeds> seeds;
  json given = json::object();   ///< in place of seeds: the fragments that have a label or a surface
  std::filesystem::path labels;  ///< the file of these labels
};

/// What a case gives of its fragments.
struct Fragments {
  List<Seeds> seeds;
  List<Volume> label;
  List<Mesh> surface;

  std::size_t count() const {
    std::size_t wanted = label.size() + surface.size();
    for (const Seeds& one : seeds) wanted += one.wanted;
    return wanted;
  }
};

/// Reads the labels and surfaces of the fragments that are to be registered.
Fragments fragments_of(const Order& order, const Workbench& workbench, Job& job) {
  Fragments fragments{order.seeds, {}, {}};
  json labels = json::array(), names = json::array();
  for (const auto& [name, fragment] : order.given.items()) {
    if (!fragment.value("register", true)) continue;
    if (fragment.contains("surface")) {
      const json& surface = fragment["surface"];
      const std::string file = workbench.folder.inside(surface.at("file").get<std::string>()).string();
      const auto outputs =
          outputs_of({"read.mesh", {{"path", file}, {"scale", surface.value("scale", 1.0)}}}, workbench, job);
      fragments.surface.add(name, outputs.at("mesh").as<Mesh>());
    } else {
      const json label = fragment.value("label", json());
      labels.push_back(label.is_string() ? label : json(label.dump()));
      names.push_back(name);
    }
  }
  if (names.empty()) return fragments;
  if (order.labels.empty()) throw Error("there is no label map; choose one");
  const auto outputs = outputs_of(
      {"read.labels", {{"path", order.labels.string()}, {"labels", labels}, {"fragments", names}}}, workbench, job);
  fragments.label = outputs.at("label").as_list<Volume>();
  return fragments;
}

/// `volume`: the CT, or a coarser one; absent where the case has none.
Segmentation segmented(const Order& order, const Fragments& fragments, const std::shared_ptr<const OpenCt>& ct,
                       const Value& volume, const Workbench& workbench, Job& job) {
  PipelineCall call{.file = workbench_pipeline(order.pipeline)};
  call.arguments.inputs.push_back({"case", workbench.folder.path().string()});  // not read: its values are given
  if (!order.threshold_hu.empty()) call.arguments.inputs.push_back({"threshold_hu", order.threshold_hu});
  call.given["case"] = {volume,
                        Value::of(fragments.seeds, "fragment"),
                        Value::of(fragments.label, "fragment"),
                        Value::of(fragments.surface, "fragment"),
                        Value::of(List<View>{}, "view"),
                        Value::of(List<Pose>{}, "fragment"),
                        Value::of(List<Truth>{}, "fragment")};
  call.keep = ct && volume.as<Volume>().values.size() * sizeof(float) * fragments.seeds.size() < kMostStoredBytes;
  const auto outputs = outputs_of(call, workbench, job);
  return {ct, outputs.at("bone").as_list<SignedField>(), outputs.at("surface").as_list<Mesh>()};
}

json grown(const std::string& name, const std::string& stage, const Segmentation& segmentation) {
  json volumes = json::object();
  for (std::size_t f = 0; f < segmentation.surfaces.size(); ++f)
    volumes[segmentation.surfaces.name(f)] = enclosed_volume_mm3(segmentation.surfaces[f]) / 1000;
  return {{"event", "grown"}, {"segmentation", name}, {"stage", stage}, {"volumes_ml", volumes}};
}

/// Throws Error if the fields on the CT's grid would take too much memory.
void check_memory(std::size_t fields, const Grid& grid) {
  const std::uintmax_t bytes = std::uintmax_t(fields) * grid.count() * sizeof(float);
  if (bytes <= most_ct_bytes()) return;
  const std::string text = formatted(
      "on the grid of the CT, {} fragments would take {:.1f} GB of memory, and at most {:.1f} GB are used here; "
      "the result on the coarse grid stays. Register fewer fragments, or cut the CT to the bone",
      int(fields), double(bytes) / 1e9, double(most_ct_bytes()) / 1e9);
  throw Error(text);
}

json segment(const Order& order, const std::shared_ptr<const OpenCt>& ct, Segmentations& kept, Workbench& workbench,
             Job& job) {
  const std::string name = kept.new_name();
  const Fragments fragments = fragments_of(order, workbench, job);
  const auto step = ct ? coarse_steps(ct->volume().grid, kCoarseVoxels) : kEachVoxel;
  if (step != kEachVoxel && order.given.empty()) {
    const auto coarse = Value::of(std::make_shared<const Volume>(coarser(ct->volume(), step)));
    try {
      const auto first = std::make_shared<const Segmentation>(segmented(order, fragments, ct, coarse, workbench, job));
      kept.keep(name, first);
      job.tell(grown(name, "coarse", *first));
    } catch (const Error& error) {
      if (job.stopped()) throw;  // thin bone may be lost on a coarse grid; the fine one decides
      job.tell({{"event", "message"}, {"text", "on a coarse grid: " + printable(error.what())}});
    }
  }
  if (ct) check_memory(fragments.count(), ct->volume().grid);
  const auto fine = std::make_shared<const Segmentation>(
      segmented(order, fragments, ct, ct ? ct->value : Value::of(std::shared_ptr<const Volume>()), workbench, job));
  kept.keep(name, fine);
  const json result = grown(name, "full", *fine);
  job.tell(result);
  return result;
}

Order order_of(const Request& request, const Workbench& workbench) {
  Order order;
  const std::string method = request.text("method");
  if (method != "bone" && method != "femur" && method != "given")
    throw Error("the method must be 'bone', 'femur' or 'given', got " + in_quotes(printable(method)));
  order.pipeline = "segment-" + method;
  if (method == "bone" && request.body.contains("threshold_hu"))
    order.threshold_hu = request.body["threshold_hu"].dump();
  const json fragments = request.body.value("fragments", json::object());
  if (method == "given") {
    order.given = fragments;
    if (request.body.contains("labels")) order.labels = workbench.folder.inside(request.text("labels"));
  } else {
    order.seeds = seeds_of(fragments);
  }
  return order;
}

Answer outlines(const Segmentation& segmentation, int axis, int index) {
  json fragments = json::array();
  std::string bytes;
  for (std::size_t f = 0; f < segmentation.fields.size(); ++f) {
    const auto ends = outline_in_slice(segmentation.fields[f], segmentation.ct->volume().grid, axis, index);
    fragments.push_back({{"name", segmentation.fields.name(f)}, {"numbers", ends.size()}});
    bytes += bytes_of_items(ends);
  }
  return bytes_answer(std::move(bytes), fragments);
}

Answer surface(const Mesh& mesh) {
  std::string bytes = bytes_of_items(floats_of(mesh.vertices_mm)) + bytes_of_items(mesh.triangles);
  return bytes_answer(std::move(bytes), {{"vertices", mesh.vertices_mm.size()}, {"triangles", mesh.triangles.size()}});
}

}  // namespace

void add_segmenting(Server& server, Workbench& workbench, const std::shared_ptr<CtMemory>& memory) {
  const auto kept = std::make_shared<Segmentations>();
  server.post("/api/segment", [&workbench, memory, kept](const Request& request) {
    const Order order = order_of(request, workbench);
    const auto ct = request.body.contains("ct") ? memory->by_name(request.text("ct")) : nullptr;
    if (!ct && order.given.empty()) throw Error("only a CT can be segmented from seeds; choose one");
    return json_answer({{"job", workbench.jobs.start("Segmenting", "",
                                                     [&workbench, kept, order, ct](Job& job) {
                                                       return segment(order, ct, *kept, workbench, job);
                                                     })},
                        {"pipeline", workbench_pipeline(order.pipeline).string()}});
  });
  server.get("/api/segmentation/outlines", [kept](const Request& request) {
    const auto segmentation = kept->find(request.parameter("segmentation"));
    const int axis = request.number("axis", 0, 2);
    if (!segmentation->ct) throw Error("this segmentation has no CT, so it has no slices");
    return outlines(*segmentation, axis,
                    request.number("index", 0, segmentation->ct->volume().grid.size[std::size_t(axis)] - 1));
  });
  server.get("/api/segmentation/surface", [kept](const Request& request) {
    const auto segmentation = kept->find(request.parameter("segmentation"));
    const Mesh* mesh = segmentation->surfaces.find(request.parameter("fragment"));
    if (!mesh) throw Error("there is no fragment " + in_quotes(printable(request.parameter("fragment"))));
    return surface(*mesh);
  });
}

}  // namespace marrow::workbench
