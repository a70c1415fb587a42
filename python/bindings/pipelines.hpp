// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <pybind11/pybind11.h>

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "marrow/runtime/pipeline/pipeline.hpp"

namespace marrow::python {

namespace py = pybind11;

/// The catalogue of the folders that are searched now. It is made once; and again after MARROW_PLUGIN_PATH changed or
/// after forget_catalogue().
std::shared_ptr<const Catalogue> catalogue();
void forget_catalogue();

/// A pipeline that was read, with all that a run of it needs.
struct ReadPipeline {
  std::shared_ptr<const Catalogue> known;
  Pipeline pipeline;
  PipelineArguments arguments;
  std::map<std::string, std::vector<Value>> given;  ///< outputs of nodes that are not called
  bool is_one_node = false;                         ///< of a node that is called as a function
};

/// A list of dictionaries, in the order of the file: file, line, column, message, hint, node, port, option. What is not
/// known is None. `called`: the node whose call has these faults.
py::list list_of(const Diagnostics& diagnostics, const NodeInfo* called = nullptr);

void bind_catalogue(py::module_& module);
void bind_pipelines(py::module_& module);
void bind_runs(py::module_& module);

/// Does the work on a thread of its own, without Python's lock, and waits for its end. If Python gets a signal
/// meanwhile (Ctrl-C) and its handler raises an exception, `cancelled` becomes true; the exception goes on when the
/// work has ended. No signal handler is changed. What the work throws is thrown.
void do_interruptibly(std::atomic<bool>& cancelled, const std::function<void()>& work);

}  // namespace marrow::python
