// SPDX-License-Identifier: Apache-2.0
#pragma once
// The processes that hold the nodes of one Python file.
#include <functional>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "marrow/runtime/node/context.hpp"
#include "marrow/runtime/plugins/asked_functions.hpp"
#include "marrow/runtime/plugins/library.hpp"
#include "marrow/runtime/plugins/python_file.hpp"
#include "marrow/runtime/process/shared_inputs.hpp"

namespace marrow {

struct PythonProcess;

/// The inputs and options of a call as JSON, and the memory and the functions that the JSON names.
struct PythonArguments {
  nlohmann::json inputs = nlohmann::json::array(), options = nlohmann::json::array();
  std::vector<std::shared_ptr<const SharedInput>> memory;
  std::shared_ptr<AskedFunctions> functions = std::make_shared<AskedFunctions>();

  PythonArguments(const std::vector<Value>& inputs, const std::vector<OptionValue>& options);
};

/// Each process does one request at a time and then waits for the next. Safe to use from several threads: each thread
/// uses its own process.
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

}  // namespace marrow
