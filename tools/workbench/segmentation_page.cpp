// SPDX-License-Identifier: Apache-2.0
// The requests of the page "Case" about segmenting: a job that segments, first on a coarse grid, then on that of the
// CT; the outlines in the slices; the surfaces.
#include <deque>

#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/domain/case.hpp"
#include "marrow/domain/mesh.hpp"
#include "workbench/ct_requests.hpp"
#include "workbench/segmentation.hpp"
#include "workbench/value_json.hpp"

namespace marrow::workbench {
namespace {

using nlohmann::json;

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
