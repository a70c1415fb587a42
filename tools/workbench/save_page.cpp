// SPDX-License-Identifier: Apache-2.0
// The requests of the page "Case" about its draft: changing it, undo and redo, and saving it as a case.
#include "marrow/base/printable.hpp"
#include "marrow/base/text_file.hpp"
#include "workbench/case_files.hpp"
#include "workbench/ct.hpp"

namespace fs = std::filesystem;

namespace marrow::workbench {
namespace {

using nlohmann::json;

bool is_inside(const Grid& grid, const Eigen::Vector3d& point_mm) {
  const Eigen::Vector3d index = grid.index_from_point(point_mm);
  for (int k = 0; k < 3; ++k)
    if (!(index[k] >= -0.5 && index[k] <= grid.size[std::size_t(k)] - 0.5)) return false;
  return true;
}

/// Whether a voxel of the mask lies in the grid.
bool meets(const Grid& grid, const Volume& mask) {
  std::size_t at = 0;
  for (int z = 0; z < mask.grid.size[2]; ++z)
    for (int y = 0; y < mask.grid.size[1]; ++y)
      for (int x = 0; x < mask.grid.size[0]; ++x)
        if (mask.values[at++] > 0 && is_inside(grid, mask.grid.point_from_index(Eigen::Vector3d(x, y, z)))) return true;
  return false;
}

/// Throws Error with all fragments that are not in the CT.
void check_fragments(const Grid& ct, const std::map<std::string, Value>& outputs) {
  std::string faults;
  const auto miss = [&](const std::string& fragment, const std::string& fault) {
    faults += (faults.empty() ? "" : "\n") + ("fragment " + in_quotes(printable(fragment)) + ": " + fault);
  };
  for (const Seeds& seeds : outputs.at("seeds").as_list<Seeds>())
    for (const Eigen::Vector3d& point_mm : seeds.points_mm)
      if (!is_inside(ct, point_mm)) miss(seeds.fragment, "a seed lies outside the CT; move it into the bone");
  const auto masks = outputs.at("label").as_list<Volume>();
  for (std::size_t i = 0; i < masks.size(); ++i)
    if (!meets(ct, masks[i])) miss(masks.name(i), "its label lies outside the CT; were both made from the same scan?");
  const auto surfaces = outputs.at("surface").as_list<Mesh>();
  for (std::size_t i = 0; i < surfaces.size(); ++i)
    if (std::none_of(surfaces[i].vertices_mm.begin(), surfaces[i].vertices_mm.end(),
                     [&](const Eigen::Vector3d& vertex_mm) { return is_inside(ct, vertex_mm); }))
      miss(surfaces.name(i),
           "its surface lies outside the CT; is it in cm, in another frame (RAS), or of another scan?");
  if (!faults.empty()) throw Error(faults);
}

/// Reads the written case as a pipeline does, and checks that its fragments are in the CT.
void check_case(const fs::path& place, bool has_landmarks, const Workbench& workbench, Job& job) {
  PipelineCall call{
      .file = workbench_pipeline("case"), .only = {"ct", "seeds", "label", "surface", "views"}, .keep = false};
  call.arguments.inputs.push_back({"case", place.string()});
  if (has_landmarks) call.only.push_back("landmarks");
  const auto outputs = outputs_of(call, workbench, job);
  if (const Value& ct = outputs.at("ct"); !ct.is_absent()) check_fragments(ct.as<Volume>().grid, outputs);
}

/// The texts of a case's files, with the comments of the existing ones.
struct CaseTexts {
  std::string case_yaml, landmarks_yaml;
  std::vector<std::string> lost;  ///< comments that are not kept
};

CaseTexts texts_of(const fs::path& place, const PlannedCase& plan, const json& document) {
  CaseTexts texts{case_yaml(plan), landmarks_yaml(document), {}};
  const auto keep = [&](const char* name, std::string& text) {
    if (!fs::exists(place / name)) return;
    const KeptText kept = with_comments_of(read_text_file(place / name, kMostSourceBytes), text);
    if (!text.empty()) text = kept.text;
    texts.lost.insert(texts.lost.end(), kept.lost.begin(), kept.lost.end());
  };
  keep("case.yaml", texts.case_yaml);
  keep("landmarks.yaml", texts.landmarks_yaml);
  return texts;
}

json lost_comments(const std::string& case_path, Workbench& workbench) {
  const json document = workbench.drafts.open(case_path)["document"];
  const PlannedCase plan = plan_case(workbench.folder, case_path, document);
  json lost = json::array();
  for (const std::string& comment : texts_of(workbench.folder.inside(case_path), plan, document).lost)
    lost.push_back(printable(comment));
  return {{"lost", lost}};
}

json save(const std::string& case_path, int revision, Workbench& workbench, CtMemory& memory, Job& job) {
  json draft = workbench.drafts.open(case_path);
  if (draft["revision"] != revision) throw Conflict("this case was changed in another tab; look at it and save again");
  const json& document = draft["document"];
  const PlannedCase plan = plan_case(workbench.folder, case_path, document);
  const fs::path place = workbench.folder.inside(case_path);
  const CaseTexts texts = texts_of(place, plan, document);
  job.tell({{"event", "message"}, {"text", "writing and reading back"}});
  const json& ct = document["ct"];
  const auto content_at = [&](const fs::path& file) { return content_of_ct(file, ct, FilesOfCt(file)); };
  const std::string content = ct.is_object() ? content_at(workbench.folder.inside(ct["file"])) : "";
  write_case_files(place, plan, texts.case_yaml, texts.landmarks_yaml,
                   [&](const fs::path& staged) { check_case(staged, !texts.landmarks_yaml.empty(), workbench, job); });
  if (ct.is_object())  // so that it is not read again
    memory.add_copy(content, content_at(place / plan.document["ct"]["file"]));
  json copied = json::array();
  for (const PlannedCase::File& file : plan.files)
    if (file.is_new) copied.push_back(file.name);
  json after = plan.document;
  put_below(after, case_path);
  if (after != document) {  // so that nothing is copied again the next time
    draft = workbench.drafts.change(case_path, revision, "use the files in the case's folder", std::move(after));
    revision = draft["revision"];
  }
  return {{"draft", workbench.drafts.mark_saved(case_path, revision)},
          {"copied", copied},
          {"folder", place.string()},
          {"pipelines", workbench_pipeline("case").parent_path().parent_path().string()}};
}

}  // namespace

void add_case_page(Server& server, Workbench& workbench) {
  server.get("/api/draft",
             [&](const Request& request) { return json_answer(workbench.drafts.open(request.parameter("case"))); });
  server.post("/api/draft/change", [&](const Request& request) {
    return json_answer(workbench.drafts.change(request.text("case"), request.body.value("revision", -1),
                                               request.text("what"), request.body.value("document", json())));
  });
  for (const bool is_redo : {false, true})
    server.post(is_redo ? "/api/draft/redo" : "/api/draft/undo", [&workbench, is_redo](const Request& request) {
      return json_answer(workbench.drafts.step(request.text("case"), request.body.value("revision", -1), is_redo));
    });
}

void add_saving(Server& server, Workbench& workbench, const std::shared_ptr<CtMemory>& memory) {
  server.get("/api/case/lost-comments", [&workbench](const Request& request) {
    return json_answer(lost_comments(request.parameter("case"), workbench));
  });
  server.post("/api/case/save", [&workbench, memory](const Request& request) {
    const std::string case_path = request.text("case");
    const int revision = request.body.value("revision", -1);
    workbench.folder.inside(case_path);
    return json_answer(
        {{"job", workbench.jobs.start("Saving the case", "", [&workbench, memory, case_path, revision](Job& job) {
            return save(case_path, revision, workbench, *memory, job);
          })}});
  });
}

}  // namespace marrow::workbench
