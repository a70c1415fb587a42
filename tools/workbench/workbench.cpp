// SPDX-License-Identifier: Apache-2.0
#include "workbench/workbench.hpp"

#include "commands.hpp"
#include "marrow/base/json_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"
#include "new/templates.hpp"
#include "report/report.hpp"

namespace marrow::workbench {

std::filesystem::path workbench_pipeline(const std::string& name) {
  return cli::shared_files(std::filesystem::path("pipelines/workbench") / (name + ".yaml"));
}

std::string set_text(const nlohmann::json& value) {
  std::string text;
  for (const char c : json_text(value)) text += c == '$' ? "$$" : std::string(1, c);
  return text;
}

std::string command_of(const PipelineCall& call) {
  std::string command = "marrow run " + cli::shell_path(call.file);
  const auto add = [&](const std::string& before, const std::string& word) {
    command += before + cli::shell_word(word);
  };
  for (const InputValue& input : call.arguments.inputs) add(" ", input.name + "=" + input.value);
  for (const Override& one : call.arguments.overrides) add(" --set ", one.key + "=" + one.value);
  for (const std::string& output : call.only) add(" --only ", output);
  return command;
}

std::string command_of(const NodeCall& call) {
  PipelineCall shown{.file = workbench_pipeline("node"), .arguments = {{}, {{"node.uses", call.name}}}};
  for (const auto& [option, value] : call.options)
    shown.arguments.overrides.push_back({"node." + option, set_text(value)});
  return command_of(shown);
}

std::string command_in_folder(const Workbench& workbench, const std::string& command) {
  return "cd " + cli::shell_path(workbench.folder.path()) + " && marrow " + command;
}

namespace {

std::map<std::string, Value> outputs_of(const Pipeline& pipeline, RunSettings settings, const Workbench& workbench,
                                        Job& job) {
  settings.cancelled = &job.stopped();
  settings.observer = [&](const RunEvent& event) { job.tell(cli::json_of(event)); };
  settings.remember = false;
  const RunResult result = run_pipeline(pipeline, workbench.catalogue, settings);
  for (std::size_t i = 0; i < result.nodes.size(); ++i)
    if (result.nodes[i].status == NodeRecord::Status::failed)
      throw Error(pipeline.nodes[i].id + " (" + pipeline.nodes[i].info.name + "): " + result.nodes[i].reason);
  if (result.cancelled()) throw Error("stopped");
  std::map<std::string, Value> outputs;
  for (const PipelineOutput& output : pipeline.outputs) outputs[output.name] = value_of(result, output.source);
  return outputs;
}

using nlohmann::json;

constexpr std::size_t kMostEvents = 5000;  // later ones are dropped; only long sequences have so many
constexpr std::size_t kMostRunning = 8, kMostEnded = 200;

}  // namespace

std::map<std::string, Value> outputs_of(const PipelineCall& call, const Workbench& workbench, Job& job) {
  Diagnostics diagnostics;
  Pipeline pipeline = read_pipeline(call.file, call.arguments, workbench.catalogue, diagnostics);
  if (!diagnostics.empty()) throw Error(diagnostics.text());
  if (!call.only.empty())
    std::erase_if(pipeline.outputs, [&](const PipelineOutput& output) { return !contains(call.only, output.name); });
  RunSettings settings;
  settings.given = call.given;
  if (call.keep) settings.store = workbench.usable_store();
  return outputs_of(pipeline, settings, workbench, job);
}

std::map<std::string, Value> outputs_of(const NodeCall& call, const Workbench& workbench, Job& job) {
  std::vector<std::pair<std::string, std::string>> options;
  for (const auto& [name, value] : call.options) options.emplace_back(name, set_text(value));
  Diagnostics diagnostics;
  const OneNode one = pipeline_of_node(call.name, {}, options, workbench.catalogue, diagnostics);
  if (!diagnostics.empty()) throw Error(diagnostics.text());
  return outputs_of(one.pipeline, {}, workbench, job);
}

void Job::tell(json event) {
  const std::lock_guard lock(mutex_);
  if (events_.size() < kMostEvents) events_.push_back(std::move(event));
  changed_.notify_all();
}

void Job::end(const std::string& state, json result, const std::string& error) {
  const std::lock_guard lock(mutex_);
  state_ = state;
  result_ = std::move(result);
  error_ = error;
  changed_.notify_all();
}

json Job::state(std::size_t since, int wait_ms) const {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, std::chrono::milliseconds(wait_ms),
                    [&] { return state_ != "running" || events_.size() > since; });
  since = std::min(since, events_.size());
  return {
      {"title", title_},        {"command", command_},
      {"state", state_},        {"events", std::vector<json>(events_.begin() + std::ptrdiff_t(since), events_.end())},
      {"next", events_.size()}, {"result", result_},
      {"error", error_}};
}

Jobs::~Jobs() {
  for (auto& [name, running] : jobs_) running.job->stop();
  for (auto& [name, running] : jobs_) running.thread.join();
}

std::string Jobs::start(const std::string& title, const std::string& command, std::function<json(Job&)> work) {
  const std::lock_guard lock(mutex_);
  const auto running = std::count_if(jobs_.begin(), jobs_.end(), [](const auto& one) { return !*one.second.is_over; });
  if (std::size_t(running) >= kMostRunning) throw Error("too many jobs are running; stop one, or wait");
  for (auto one = jobs_.begin(); jobs_.size() >= kMostEnded && one != jobs_.end();)
    if (*one->second.is_over) {
      one->second.thread.join();
      one = jobs_.erase(one);
    } else {
      ++one;
    }
  const auto job = std::make_shared<Job>(title, command);
  const auto is_over = std::make_shared<std::atomic<bool>>(false);
  const std::string name = formatted("{}", ++count_);
  std::thread thread([job, is_over, work = std::move(work)] {
    try {
      json result = work(*job);
      job->end(job->stopped() ? "stopped" : "done", std::move(result), "");
    } catch (...) {
      job->end(job->stopped() ? "stopped" : "failed", nullptr, printable_lines(reason_of_exception()));
    }
    *is_over = true;
  });
  jobs_.emplace(name, Running{job, std::move(thread), is_over});
  return name;
}

std::shared_ptr<Job> Jobs::find(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(name);
  if (found == jobs_.end()) throw Error("there is no job " + in_quotes(printable(name)));
  return found->second.job;
}

json json_of(const Eigen::Vector3d& vector) { return {vector.x(), vector.y(), vector.z()}; }

json json_of(const RigidTransform& target_from_source) {
  json rows = json::array();
  for (int i = 0; i < 3; ++i) {
    json row = json::array();
    for (int k = 0; k < 3; ++k) row.push_back(target_from_source.rotation(i, k));
    row.push_back(target_from_source.translation_mm[i]);
    rows.push_back(row);
  }
  rows.push_back({0, 0, 0, 1});
  return rows;
}

json json_of(const Camera& camera) {
  json intrinsics = json::array();
  for (int i = 0; i < 3; ++i)
    intrinsics.push_back({camera.intrinsics(i, 0), camera.intrinsics(i, 1), camera.intrinsics(i, 2)});
  return {{"intrinsics", intrinsics},
          {"camera_from_world", json_of(camera.camera_from_world)},
          {"width_px", camera.width_px},
          {"height_px", camera.height_px}};
}

std::vector<float> floats_of(const std::vector<Eigen::Vector3d>& points) {
  std::vector<float> numbers;
  numbers.reserve(3 * points.size());
  for (const Eigen::Vector3d& point : points)
    for (int k = 0; k < 3; ++k) numbers.push_back(float(point[k]));
  return numbers;
}

std::string bytes_of_pixels(const cv::Mat& pixels) {
  std::string bytes;
  bytes.reserve(pixels.total() * pixels.elemSize());
  for (int row = 0; row < pixels.rows; ++row)
    bytes.append(pixels.ptr<char>(row), std::size_t(pixels.cols) * pixels.elemSize());
  return bytes;
}

}  // namespace marrow::workbench
