// SPDX-License-Identifier: Apache-2.0
#pragma once
// Functions that nodes written in Python make: costs, optimizers and projectors of radiographs; and the processes that
// hold them.
#include <functional>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "marrow/runtime/plugins/asked_functions.hpp"
#include "marrow/runtime/plugins/python_file.hpp"
#include "marrow/runtime/process/packed_values.hpp"

namespace marrow {

struct PythonProcess;

/// The inputs and options of a call as JSON, and the memory and the functions that the JSON names.
struct PythonArguments {
  nlohmann::json inputs = nlohmann::json::array(), options = nlohmann::json::array();
  std::vector<std::shared_ptr<const SharedInput>> memory;
  std::shared_ptr<AskedFunctions> functions = std::make_shared<AskedFunctions>();

  PythonArguments(const std::vector<Value>& inputs, const std::vector<OptionValue>& options);
};

/// The processes that hold the nodes of one Python file. Each does one request at a time and then waits for the next.
/// Safe to use from several threads: each thread uses its own process.
class PythonNodes {
 public:
  /// Answers what a process asks back during a request: {"say": "ask", ...}. What it throws ends the request. Questions
  /// about functions among the inputs are answered without it.
  using Reply = std::function<nlohmann::json(const nlohmann::json& question)>;

  explicit PythonNodes(LibraryInfo described);
  ~PythonNodes();

  /// Has a process answer a request about a node, with these arguments. `outputs`, if it is not null, receives the
  /// values that the process handed over. Throws Error if the process fails, crashes or exceeds the node's limits,
  /// Cancelled, and what `reply` throws.
  nlohmann::json ask(const NodeInfo& node, nlohmann::json request, const PythonArguments& arguments, Context& context,
                     std::vector<Value>* outputs, const Reply& reply = nullptr);

 private:
  std::unique_ptr<PythonProcess> take(Context& context);
  void give_back(std::unique_ptr<PythonProcess> process);
  void learn(const nlohmann::json& answer);
  std::string changed() const;

  LibraryInfo described_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<PythonProcess>> idle_;
  std::set<std::string> undescribed_;  ///< files that were loaded, and that the description does not name
};

/// A function of a node, which a process keeps under a number. A process that does not have it makes it first.
class PythonFunction {
 public:
  PythonFunction(std::shared_ptr<PythonNodes> nodes, NodeInfo node, std::vector<Value> inputs,
                 const std::vector<OptionValue>& options);

  const std::string& name() const { return node_.name; }
  /// Has a process make the function, so that a fault of its inputs is reported at once.
  nlohmann::json make(Context& context) const;
  /// Has a process answer a request about the function, as PythonNodes::ask() does.
  nlohmann::json ask(nlohmann::json request, std::vector<Value>* outputs = nullptr,
                     const PythonNodes::Reply& reply = nullptr) const;

  /// The functions among its inputs.
  const AskedFunctions& functions() const { return *arguments_.functions; }
  /// The same function, made of costs at a level. Another one, so a process makes it anew.
  PythonFunction at_level(const CostLevel& level) const;

 private:
  std::shared_ptr<PythonNodes> nodes_;
  NodeInfo node_;
  std::vector<Value> inputs_;
  std::vector<OptionValue> options_;
  std::shared_ptr<const PythonFunction> origin_;  ///< costs at a level may refer to its inputs
  PythonArguments arguments_;
  std::uint64_t number_ = 0;
};

std::shared_ptr<const RadiographProjector> python_projector(PythonFunction function, Context& context);

/// Whether the node makes a function and not data.
bool makes_function(const NodeInfo& node);

/// What such a node makes. Throws as PythonNodes::ask() does if it cannot be made.
Value value_of_function(const NodeInfo& node, PythonFunction function, Context& context);

}  // namespace marrow
