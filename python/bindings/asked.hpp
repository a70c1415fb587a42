// SPDX-License-Identifier: Apache-2.0
#pragma once
// Functions of the process that runs the pipeline, as a node written in Python has them among its inputs.
#include <pybind11/stl.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "values.hpp"

namespace marrow::python {

/// The other process. `ask` takes a question and, for an optimizer, a function that gives values; it returns the reply.
/// It may be called from any thread.
class Asked {
 public:
  Asked(py::object ask, std::uint64_t function)
      : ask_(std::make_shared<py::object>(std::move(ask))), function_(function) {}
  ~Asked() {
    const py::gil_scoped_acquire acquire;
    ask_.reset();
  }
  Asked(const Asked& other) : function_(other.function_), changes_(other.changes_) {
    const py::gil_scoped_acquire acquire;
    ask_ = other.ask_;
  }
  Asked& operator=(const Asked&) = delete;

  /// The same function at another level, or smoothed.
  Asked changed(std::vector<double> change) const {
    Asked made = *this;
    made.changes_.push_back(std::move(change));
    return made;
  }

  /// Fills the question in, asks, and lets `read` take the reply, all with Python's lock.
  void ask(const std::function<void(py::dict&)>& fill, const std::function<void(const py::object&)>& read,
           const py::object* own = nullptr) const {
    const py::gil_scoped_acquire acquire;
    py::dict question;
    question["function"] = function_;
    if (!changes_.empty()) question["changes"] = changes_;
    fill(question);
    read(own ? (*ask_)(question, *own) : (*ask_)(question));
  }

 private:
  std::shared_ptr<py::object> ask_;
  std::uint64_t function_;
  std::vector<std::vector<double>> changes_;
};

/// Transforms as 12 numbers each: the first three rows of the matrix.
py::list listed_transforms(const std::vector<RigidTransform>& transforms);

/// A projector of this type. Throws Error if the type is none of a projector.
Value asked_projector(const std::string& type, Asked asked);

}  // namespace marrow::python
