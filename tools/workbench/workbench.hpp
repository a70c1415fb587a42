// SPDX-License-Identifier: Apache-2.0
#pragma once
// What all pages of `marrow open` work with, and how they run pipelines.
#include <condition_variable>
#include <opencv2/core.hpp>
#include <thread>

#include "marrow/domain/camera.hpp"
#include "marrow/runtime/run/executor.hpp"
#include "workbench/drafts.hpp"
#include "workbench/server.hpp"

namespace CLI {
class App;
}

namespace marrow::workbench {

// Work that takes longer than a request. It runs in its own thread, and the page asks for its progress.

/// The reports of a running job. Methods may be called from several threads.
class Job {
 public:
  Job(std::string title, std::string command) : title_(std::move(title)), command_(std::move(command)) {}

  /// Set when the user wants it to stop.
  const std::atomic<bool>& stopped() const { return stopped_; }
  void stop() { stopped_ = true; }
  /// Adds an event for the page, such as {"event": "finished", "node": "edges"}.
  void tell(nlohmann::json event);
  /// "done" with a result, "failed" with a text, or "stopped".
  void end(const std::string& state, nlohmann::json result, const std::string& error);
  /// {title, command, state, events, next, result, error} with the events from number `since` on. Waits until there is
  /// something new, but at most `wait_ms`.
  nlohmann::json state(std::size_t since, int wait_ms) const;

 private:
  const std::string title_, command_;
  std::atomic<bool> stopped_ = false;
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::vector<nlohmann::json> events_;
  std::string state_ = "running", error_;
  nlohmann::json result_;
};

class Jobs {
 public:
  /// Stops all jobs and waits for them.
  ~Jobs();
  /// Starts a job in its own thread and returns its name. What `work` returns is the job's result; an exception makes
  /// it fail. `command` does the same in a shell, or is empty. Throws Error if too many jobs are running.
  std::string start(const std::string& title, const std::string& command, std::function<nlohmann::json(Job&)> work);
  /// Throws Error if there is no such job.
  std::shared_ptr<Job> find(const std::string& name) const;

 private:
  struct Running {
    std::shared_ptr<Job> job;
    std::thread thread;
    std::shared_ptr<std::atomic<bool>> is_over;
  };
  mutable std::mutex mutex_;
  std::map<std::string, Running> jobs_;
  int count_ = 0;
};

struct Workbench {
  explicit Workbench(const std::filesystem::path& opened) : folder(opened) {}
  /// The store; nullptr if no results can be kept in it.
  const Store* usable_store() const { return store.fault().empty() && store.prepare().empty() ? &store : nullptr; }

  OpenedFolder folder;
  Catalogue catalogue;
  Store store;
  Drafts drafts{folder};
  Jobs jobs;  ///< the last member: jobs use the others, and end first
};

/// A pipeline that a page runs: one of share/marrow/pipelines/workbench, or one of the user.
struct PipelineCall {
  std::filesystem::path file;
  PipelineArguments arguments = {};
  std::vector<std::string> only = {};                    ///< outputs; empty = all
  std::map<std::string, std::vector<Value>> given = {};  ///< as RunSettings::given
  bool keep = true;                                      ///< in the store
};

/// A node that a page calls alone, such as a reader. What it returns is not kept in the store.
struct NodeCall {
  std::string name;                                             ///< as read.image
  std::vector<std::pair<std::string, nlohmann::json>> options;  ///< a path is absolute
};

/// share/marrow/pipelines/workbench/NAME.yaml
std::filesystem::path workbench_pipeline(const std::string& name);

/// A value as text for `--set`: a JSON string or list, with '$' escaped.
std::string set_text(const nlohmann::json& value);

/// Runs it and returns its outputs; an output that could not be made is absent. The run's events go to the job, and
/// stopping the job stops it. Throws Error with all faults of the file, or with the reason of the first node that
/// failed.
std::map<std::string, Value> outputs_of(const PipelineCall& call, const Workbench& workbench, Job& job);
/// The same for a node; its outputs have the names that the node gives them.
std::map<std::string, Value> outputs_of(const NodeCall& call, const Workbench& workbench, Job& job);

/// The command that runs it in a shell.
std::string command_of(const PipelineCall& call);
/// The same for a node: the command runs workbench/node.yaml with it.
std::string command_of(const NodeCall& call);
/// "cd FOLDER && marrow COMMAND", with the opened folder.
std::string command_in_folder(const Workbench& workbench, const std::string& command);

/// Each adds the requests of one page to the server.
void add_shell(Server& server, Workbench& workbench);
void add_case_page(Server& server, Workbench& workbench);
void add_ct_page(Server& server, Workbench& workbench);
void add_pipeline_page(Server& server, Workbench& workbench);
void add_results_page(Server& server, Workbench& workbench);
void add_xray_page(Server& server, Workbench& workbench);
void add_place_page(Server& server, Workbench& workbench);

/// Adds the command `open` with its options, its help and its callback, which sets `code` to the exit code.
void add_open(CLI::App& app, int& code);

// Values as the pages get them: JSON, and bytes of pixels and surfaces.

/// [x, y, z]
nlohmann::json json_of(const Eigen::Vector3d& vector);
/// A 4 x 4 matrix as rows.
nlohmann::json json_of(const RigidTransform& target_from_source);
/// {intrinsics, camera_from_world, width_px, height_px} with matrices as rows.
nlohmann::json json_of(const Camera& camera);

/// The coordinates of the points, one point after the other.
std::vector<float> floats_of(const std::vector<Eigen::Vector3d>& points);
/// The items as they are in memory.
template <class Item>
std::string bytes_of_items(const std::vector<Item>& items) {
  return {reinterpret_cast<const char*>(items.data()), items.size() * sizeof(Item)};
}
/// The pixels, row after row without gaps.
std::string bytes_of_pixels(const cv::Mat& pixels);

}  // namespace marrow::workbench
