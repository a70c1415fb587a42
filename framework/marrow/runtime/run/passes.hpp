// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "marrow/runtime/run/graph_run.hpp"

namespace marrow {

/// The passes of one node with a body, one after the other. No thread waits for a pass: the end of one starts the next.
class Passes {
 public:
  /// `call` has the node's inputs and receives its outputs.
  Passes(GraphRun& outer, std::size_t node, Call& call);
  ~Passes();

  /// Starts the first pass. When the last has ended, the call has its result, and the outer run goes on.
  void begin();
  /// Goes through the passes whose results are in the store, and adds to `planned` what would be run. If all are there,
  /// the call has its result.
  void plan(PlannedNode& planned);

 private:
  struct Run;

  void find_constant_nodes();
  void find_needed_outputs();
  void prepare();
  bool has_next();
  std::string name_of_pass() const;
  std::unique_ptr<Run> next_pass();
  std::unique_ptr<Run> make_run(Pipeline pipeline, const std::string& within);
  std::string within() const;
  bool is_replayed_inside() const;
  bool only_replays() const;
  void go_on();
  void run_constants();
  void after_constants();
  void after_pass();
  void take(const RunResult& result, const PassesRecord::Pass& pass);
  void note_in_profile(const std::string& pass, Clock::time_point begin) const;
  void finish(NodeRecord::Status status, const std::string& reason);
  void collect_outputs();
  void release(const std::function<void()>& work);

  GraphRun& outer_;
  std::size_t index_;
  Call& call_;
  const PipelineNode& node_;
  const Repetition& repetition_;
  std::vector<std::string> names_;                       ///< of the items that the passes are for
  std::vector<bool> is_sliced_;                          ///< by input: whether each pass gets one item of it
  std::vector<int> needed_outputs_;                      ///< of the body
  std::map<std::string, std::vector<Value>> constants_;  ///< outputs of nodes that are the same in all passes
  std::vector<std::string> constant_nodes_;
  std::vector<Value> carried_;  ///< by Repetition::given
  std::vector<bool> has_carried_;
  std::vector<Value> lists_, last_;  ///< by the output of the body
  std::shared_ptr<PassesRecord> record_ = std::make_shared<PassesRecord>();
  std::unique_ptr<Run> constants_run_, run_;
  std::size_t pass_ = 0;
  const Clock::time_point begin_ = Clock::now();
  Clock::time_point pass_begin_;
  bool is_first_ = false;  ///< whether the pass that runs has to make carried values itself
  bool is_last_ = false;   ///< whether the pass that runs is for the one call of a replay
};

/// Adds what one pass did to the record of all passes. `run`: the body as it was run, `done`: the records of its nodes.
/// `constants`: nodes that were given because they are the same in all passes.
void add_pass(const Repetition& repetition, const Pipeline& run, const std::vector<NodeRecord>& done,
              const std::vector<std::string>& constants, const std::string& pass, PassesRecord& record);

/// Adds what was done once, before the first pass.
void add_constants(const Repetition& repetition, const Pipeline& run, const std::vector<NodeRecord>& done,
                   PassesRecord& record);

}  // namespace marrow
