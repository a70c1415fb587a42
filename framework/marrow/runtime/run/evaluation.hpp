// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "marrow/base/process_state.hpp"
#include "marrow/runtime/run/executor.hpp"
#include "marrow/runtime/run/keys.hpp"

namespace marrow {

/// Calls visit(item) for each single value in `value`, in order. Goes into lists.
template <class V, class Visit>
void for_leaves(V& value, const Visit& visit) {
  if (!value.is_list()) return visit(value);
  for (auto& item : value.items) for_leaves(item, visit);
}

/// Thrown if an input cannot be made because the node that makes it failed or was not run.
struct MissingInput {
  NodeRecord::Status status;
  std::string missing;
};

/// How one call of a node ended.
struct CallResult {
  NodeRecord::Status status = NodeRecord::Status::done;
  std::string reason;
  std::vector<Value> outputs;
  bool is_deferred = false;  ///< the result is a function; it is made when a running node asks for it
  bool is_cached = false;    ///< read back from the store
};

/// One call of a node: its inputs, its place along the mapped axes, and its result.
struct Call {
  std::vector<Value> inputs;
  std::string item;
  CallResult result;
};

/// Finds the results of calls. Each recipe is evaluated once within a run: its result is read from the store if an
/// earlier run left it there, else the node is called. Functions are made only if a node that runs needs them. Safe to
/// use from several threads of the run's pool.
class Evaluation {
 public:
  /// finished(node, call) is called for each call as soon as its result is known. `records` is written under `mutex`.
  Evaluation(const Pipeline& pipeline, const Catalogue& catalogue, const RunSettings& settings,
             std::vector<NodeRecord>& records, std::mutex& mutex,
             std::function<void(std::size_t node, Call& call)> finished);
  ~Evaluation();

  void evaluate(std::size_t node, Call& call);
  /// Makes the data of a value that is needed at the end of the run. What cannot be made becomes missing.
  static void make(Value& value, const std::function<const TypeInfo&()>& type);
  /// What differs from the nearest result that the store has; for plans.
  std::string reason_to_run(std::size_t node, const Call& call) const;
  double seconds_last_time(std::size_t node, const Call& call) const;
  /// Whether the store has the result or the node makes only functions. If so, sets the result of the call as
  /// evaluate() does.
  bool find(std::size_t node, Call& call);

  void report(RunEvent::Kind kind, std::size_t node, const std::string& item, std::string text, double fraction = 0,
              double seconds = 0, LogLevel level = LogLevel::info) const;
  /// Reports an event of a body.
  void forward(const RunEvent& event) const;
  /// The result of a call that failed, which it reports. If the node may fail and `is_own`, this is a warning. A
  /// failure is not the node's own if the system refused what any node needs.
  CallResult failure(std::size_t node, const std::string& item, const std::string& reason, bool is_own = true) const;
  /// Tells RunSettings::on_failed_call, and the replay if it is its call. Throws nothing.
  void note_failure(std::size_t node, const std::string& item, const std::string& reason, std::uint64_t seed,
                    const std::vector<Value>& inputs) const;
  /// Whether RunSettings::replay is about this call.
  bool is_replayed(std::size_t node, const std::string& item) const;
  void end_replay(std::size_t node, const CallResult& result, double seconds) const;

 private:
  struct Memo;
  class Deferred;
  class DeferredSource;
  struct Recipe {
    Digest recipe, key;
    bool is_kept = false;  ///< the key under which the replayed run kept the result, and no key of a result made now
  };

  Recipe recipe(std::size_t node, const Call& call, Contents* contents = nullptr) const;
  Recipe noted_recipe(std::size_t node, const Call& call);
  void take_kept_key(std::size_t node, const Call& call, Recipe& recipe) const;
  Provenance provenance(std::size_t node, const std::vector<Value>& inputs) const;
  std::string place() const;
  std::string name_of(std::size_t node, const Call& call) const;
  std::optional<Store::Last> last(std::size_t node, const Call& call) const;
  const std::vector<Store::Last>& kept_results() const;
  void remember(std::size_t node, const Call& call, const Recipe& recipe);
  std::string failure_text(std::size_t node, const std::string& item, const std::string& reason) const;
  bool makes_functions(std::size_t node) const;
  bool is_deferred(std::size_t node) const;
  void read_or_make(std::size_t node, Call& call, const Recipe& recipe);
  void take(std::size_t node, Call& call, const CallResult& result);
  void defer(std::size_t node, Call& call, const Recipe& recipe);
  using Where = Store::Where;
  bool read_back(std::size_t node, Call& call, const Recipe& recipe, Where where);
  /// The shared store, if the node's results are of use to others.
  SharedStore* shared_for(std::size_t node) const;
  void complain_of(SharedStore& shared, std::size_t node);
  void share(const Digest& key, const CallResult& result);
  CallResult perform(std::size_t node, std::vector<Value> inputs, const std::string& item, const Recipe& recipe);
  std::vector<Value> call_node(std::size_t node, std::vector<Value>& inputs, const std::string& item,
                               const Recipe& recipe, std::vector<std::string>& warnings);
  std::uint64_t seed_of_call(std::size_t node, const std::string& item, const Recipe& recipe) const;
  void save(std::size_t node, const std::string& item, const std::vector<Value>& inputs, const Recipe& recipe,
            const CallResult& result, double seconds, std::vector<std::string> warnings);
  void check_unchanged(std::size_t node, const std::vector<Value>& inputs, const Recipe& recipe,
                       const Digest& states) const;
  static void make_inputs(const NodeDefinition& definition, std::vector<Value>& inputs);
  Context::Hooks make_hooks(std::size_t node, const std::string& item, std::uint64_t seed,
                            std::vector<std::string>& warnings);

  const Pipeline& pipeline_;
  const Catalogue& catalogue_;
  const RunSettings& settings_;
  std::vector<NodeRecord>& records_;
  std::mutex& mutex_;
  std::function<void(std::size_t, Call&)> finished_;
  std::map<Digest, std::unique_ptr<Memo>> memos_;
  FilesRead files_read_;
  Store::LastResults remembered_;                                 ///< what this run came to; written when it ends
  mutable std::optional<Store::LastResults> last_results_;        ///< what the run before came to; for plans
  mutable std::optional<std::vector<Store::Last>> kept_results_;  ///< what the store has of these nodes; for plans
  std::shared_ptr<ProcessState> state_ = ProcessState::of_runs();
  mutable std::mutex observer_mutex_, warnings_mutex_;
  bool store_complained_ = false;
};

/// The kept result of the same node that differs least from `now` in what its key is made from. The differences are why
/// the node runs again. An input that is the same as the `last` time is no reason. A result in which such an input
/// differs may be of another item, so it is taken only if there is no other. Of equally near results, the last one is
/// taken, or else the latest in `kept`. nullptr if no result of the node is kept.
MARROW_EXPORT_TO_TESTS const Provenance* nearest_result(const std::vector<Store::Last>& kept, const Store::Last& last,
                                                        const Provenance& now);

}  // namespace marrow
