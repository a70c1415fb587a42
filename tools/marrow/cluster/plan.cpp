// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "compare/cell_jobs.hpp"
#include "marrow/base/json_text.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/text_file.hpp"
#include "marrow/runtime/process/worker.hpp"
#include "marrow/runtime/run/keys.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using Numbers = std::vector<std::size_t>;

constexpr int kVersion = 2;

constexpr std::size_t kMostCaseTasks = 100;

/// Numbers in rising order, as a list of [first, behind the last].
json ranges_of(const std::vector<std::size_t>& numbers) {
  json ranges = json::array();
  for (std::size_t i = 0; i < numbers.size();) {
    std::size_t end = i + 1;
    while (end < numbers.size() && numbers[end] == numbers[end - 1] + 1) ++end;
    ranges.push_back({numbers[i], numbers[end - 1] + 1});
    i = end;
  }
  return ranges;
}

std::vector<std::size_t> numbers_of(const json& ranges) {
  std::vector<std::size_t> numbers;
  for (const json& range : ranges) {
    const auto first = integer_of(range.at(0), 0, std::int64_t(compare::kMostCells), "a number of a cell"),
               end = integer_of(range.at(1), first, std::int64_t(compare::kMostCells), "a number of a cell");
    for (auto number = first; number < end; ++number) numbers.push_back(std::size_t(number));
  }
  return numbers;
}

json of(const std::vector<Chunk>& chunks) {
  json list = json::array();
  for (const Chunk& chunk : chunks) list.push_back(ranges_of(chunk.numbers));
  return list;
}

/// A list of [path, digest]: a path need not be UTF-8, as keys of JSON must be.
json of(const std::map<std::string, std::string>& digests) {
  json list = json::array();
  for (const auto& [path, digest] : digests) list.push_back({json_of_bytes(path), digest});
  return list;
}

/// Everything but the id, which is the digest of this.
json plan_content(const ClusterPlan& plan) {
  return {{"marrow-plan", kVersion},
          {"experiment", json_of_bytes(plan.file.string())},
          {"folder", json_of_bytes(plan.folder.string())},
          {"texts", of(plan.texts)},
          {"builds", plan.builds},
          {"case digests", plan.case_digests},
          {"threads", plan.threads},
          {"time_limit_s", plan.time_limit_s},
          {"memory_limit_mb", plan.memory_limit_mb},
          {"file_memory_mb", plan.file_limits.memory_mb},
          {"file_seconds", plan.file_limits.seconds},
          {"no_cache", plan.no_cache},
          {"cases", of(plan.cases)},
          {"cells", of(plan.cells)}};
}

std::string digest_of_text(const fs::path& file) { return hash_of(read_text_file(file, kMostSourceBytes)).hex(); }

/// "ID-cases-0007": as many digits as all need, so that names sort.
void name_chunks(std::vector<Chunk>& chunks, const std::string& head) {
  const std::size_t digits = formatted("{}", chunks.size()).size();
  for (std::size_t i = 0; i < chunks.size(); ++i) {
    chunks[i].name = formatted("{}{:0{}}", head, i, digits);
  }
}

void name_all(ClusterPlan& plan, const json& content) {
  plan.id = hash_of(content.dump()).hex().substr(0, 12);
  name_chunks(plan.cases, plan.id + "-cases-");
  name_chunks(plan.cells, plan.id + "-");
}

void note_inputs(const compare::Experiment& experiment, const Catalogue& catalogue, ClusterPlan& plan) {
  for (const fs::path& file : {experiment.file, experiment.pipeline, experiment.simulation.pipeline})
    if (!file.empty()) plan.texts[fs::absolute(file).string()] = digest_of_text(file);
  for (const compare::ExperimentCase& one : experiment.cases)
    if (!one.folder.empty()) plan.case_digests[one.name] = path_digest(one.folder).hex();
  compare::CellRunner runner(experiment, catalogue, nullptr, plan.folder, 1);
  std::set<std::string> nodes;
  for (std::size_t v = 0; v < experiment.variants.size(); ++v) {
    const compare::CellIndex cell{v, 0, 0};
    for (const PipelineNode& node :
         runner.pipeline_of(cell, runner.case_place(0), compare::CellRunner::Depth::figures).nodes)
      nodes.insert(node.info.name);
  }
  for (const std::string& node : nodes)
    if (const LibraryInfo* library = catalogue.library_of(node)) plan.builds[node] = library->build_id.hex();
}

std::vector<Chunk> chunks_of(const std::vector<std::vector<std::size_t>>& lists) {
  std::vector<Chunk> chunks;
  for (const auto& numbers : lists) chunks.push_back({"", numbers});
  return chunks;
}

/// The cells without a row, and the simulated cases among theirs that are not there.
struct Left {
  std::vector<std::size_t> cells, cases;
};

Left left_of(const compare::Experiment& experiment, compare::CellRunner& runner, const fs::path& folder) {
  const RowsOfChunks known(folder, experiment, "");
  CellJobs cells(experiment, runner);
  const std::size_t of_case = experiment.starts.size() * experiment.variants.size();
  Left left;
  for (std::size_t c = 0; c < experiment.cases.size(); ++c) {
    const bool is_there = !experiment.cases[c].is_simulated || fs::exists(runner.case_place(c));
    const std::size_t before = left.cells.size();
    for (std::size_t i = c * of_case; i < (c + 1) * of_case; ++i) {
      const std::string key = is_there ? cells.take_key(i) : "";
      if (!runner.finished(cells.cell(i), key) && !known.done(cells.cell(i), key)) left.cells.push_back(i);
    }
    if (!is_there && left.cells.size() > before) left.cases.push_back(c);
  }
  return left;
}

std::vector<Numbers> by_case(const Numbers& numbers, std::size_t cells_of_a_case) {
  std::vector<Numbers> cases;
  std::size_t last = 0;
  for (const std::size_t number : numbers) {
    const std::size_t of_case = number / cells_of_a_case;
    if (cases.empty() || of_case != last) cases.emplace_back();
    last = of_case;
    cases.back().push_back(number);
  }
  return cases;
}

/// Pieces of about equal length, none shorter than `least`.
void add_pieces(const Numbers& numbers, std::size_t least, std::vector<Numbers>& chunks) {
  const std::size_t pieces = std::max<std::size_t>(1, numbers.size() / least);
  for (std::size_t i = 0; i < pieces; ++i)
    chunks.emplace_back(numbers.begin() + std::ptrdiff_t(i * numbers.size() / pieces),
                        numbers.begin() + std::ptrdiff_t((i + 1) * numbers.size() / pieces));
}

std::vector<Numbers> cut_cases(const std::vector<Numbers>& cases, std::size_t least) {
  std::vector<Numbers> chunks;
  Numbers open;
  for (const Numbers& one : cases) {
    if (open.empty() && one.size() >= 2 * least) {
      add_pieces(one, least, chunks);
      continue;
    }
    open.insert(open.end(), one.begin(), one.end());
    if (open.size() >= least) chunks.push_back(std::exchange(open, {}));
  }
  if (!open.empty()) chunks.push_back(std::move(open));
  return chunks;
}

}  // namespace

ClusterPlan make_plan(const CompareRequest& request, const Catalogue& catalogue, const compare::Experiment& experiment,
                      const fs::path& folder, const ChunkRule& rule) {
  ClusterPlan plan;
  plan.file = fs::absolute(request.file);
  plan.folder = fs::absolute(folder).lexically_normal();
  plan.threads = request.threads;
  plan.time_limit_s = request.time_limit_s;
  plan.memory_limit_mb = request.memory_limit_mb;
  plan.file_limits = request.file_limits;
  plan.no_cache = request.no_cache;
  note_inputs(experiment, catalogue, plan);
  const Store store;
  const Store* kept = request.no_cache ? nullptr : &store;
  compare::CellRunner runner(experiment, catalogue, kept, folder, 1);
  runner.keep_dependencies();
  const Left left = left_of(experiment, runner, folder);
  if (!left.cells.empty()) {
    const WorkEstimate work = estimate_of(experiment, catalogue, kept, folder);
    const double seconds = work.unknown > 0 ? 0 : work.seconds / double(left.cells.size());
    plan.cells =
        chunks_of(cut_into_chunks(left.cells, experiment.starts.size() * experiment.variants.size(), seconds, rule));
    plan.cases = chunks_of(cut_into_chunks(left.cases, 1, 0, {0, std::min(rule.most_tasks, kMostCaseTasks)}));
  }
  if (plan.cells.empty()) return plan;
  const json content = plan_content(plan);
  name_all(plan, content);
  std::error_code error;
  fs::create_directories(plan.place().parent_path(), error);
  write_text_file(plan.place(), content.dump(1) + "\n");
  write_text_file(plan.folder / "plans" / "latest.txt", plan.id + "\n");
  return plan;
}

ClusterPlan read_plan(const fs::path& file) {
  try {
    const json j = parse_json(read_text_file(file, kMostRecordBytes), file.string());
    if (j.at("marrow-plan") != kVersion) throw Error("it is of another version of marrow");
    ClusterPlan plan;
    plan.file = bytes_of_json(j.at("experiment"));
    plan.folder = bytes_of_json(j.at("folder"));
    for (const json& text : j.at("texts")) plan.texts[bytes_of_json(text.at(0))] = text.at(1);
    plan.builds = j.at("builds");
    plan.case_digests = j.at("case digests");
    plan.threads = int(integer_of(j.at("threads"), 1, 1024, "'threads'"));
    plan.time_limit_s = j.at("time_limit_s");
    plan.memory_limit_mb = j.at("memory_limit_mb");
    plan.file_limits.memory_mb = j.at("file_memory_mb");
    plan.file_limits.seconds = j.at("file_seconds");
    plan.no_cache = j.at("no_cache");
    for (const json& ranges : j.at("cases")) plan.cases.push_back({"", numbers_of(ranges)});
    for (const json& ranges : j.at("cells")) plan.cells.push_back({"", numbers_of(ranges)});
    name_all(plan, plan_content(plan));
    if (plan.id != file.stem()) throw Error("it was changed, or renamed");
    return plan;
  } catch (const std::exception& error) {
    throw Error(file.string() + " is no plan of a comparison: " + error.what());
  }
}

ClusterPlan latest_plan(const fs::path& folder) {
  std::string id;
  try {
    id = read_text_file(folder / "plans" / "latest.txt", 100);
  } catch (const Error&) {
    throw Error("there is no plan in " + folder.string() + "; give --on slurm or --emit first");
  }
  return read_plan(fs::absolute(folder).lexically_normal() / "plans" / (id.substr(0, id.find('\n')) + ".json"));
}

void expect_as_planned(const ClusterPlan& plan, const Catalogue& catalogue, const compare::Experiment& experiment) {
  const auto refuse = [](const std::string& what) {
    throw Error(what + " is not what it was when the plan was made; give the command that made the plan again");
  };
  for (const auto& [file, digest] : plan.texts)
    if (digest_of_text(file) != digest) refuse(file);
  for (const auto& [node, build] : plan.builds)
    if (const LibraryInfo* library = catalogue.library_of(node); !library || library->build_id.hex() != build)
      refuse("the plugin of " + node + " on this host");
  const std::size_t cells = experiment.cell_count(), cases = experiment.cases.size();
  for (const auto& [chunks, count] : {std::pair(&plan.cells, cells), std::pair(&plan.cases, cases)})
    for (const Chunk& chunk : *chunks)
      for (const std::size_t number : chunk.numbers)
        if (number >= count) refuse("the list of cases or variants");
}

// How the cells of a comparison are cut into chunks.

std::vector<Numbers> cut_into_chunks(const Numbers& numbers, std::size_t cells_of_a_case, double seconds_of_a_cell,
                                     const ChunkRule& rule) {
  const double wanted = seconds_of_a_cell > 0 ? std::ceil(60 * rule.least_minutes / seconds_of_a_cell) : 1;
  std::size_t least = std::size_t(std::clamp(wanted, 1., double(std::max<std::size_t>(1, numbers.size()))));
  if (!(seconds_of_a_cell > 0)) least = std::max<std::size_t>(1, cells_of_a_case);
  const std::vector<Numbers> cases = by_case(numbers, cells_of_a_case);
  std::vector<Numbers> chunks = cut_cases(cases, least);
  while (chunks.size() > rule.most_tasks) chunks = cut_cases(cases, least = least + least / 4 + 1);
  return chunks;
}

}  // namespace marrow::cli
