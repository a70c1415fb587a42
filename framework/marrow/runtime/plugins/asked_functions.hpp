// SPDX-License-Identifier: Apache-2.0
#pragma once
// Functions that a node written in Python takes. They stay in this process; the node's process asks for their values.
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <vector>

#include "marrow/runtime/node/types.hpp"

namespace marrow {

/// Asks the process something while it waits for a reply, and returns its answer.
using AskProcess = std::function<nlohmann::json(const nlohmann::json& question)>;

/// The functions among the inputs of a call, by their numbers. No two functions of this process have the same number,
/// so a node that keeps one for a later call cannot get another one's values. Safe to use from several threads.
class AskedFunctions {
 public:
  /// Takes a function, and returns how a request names it.
  nlohmann::json add(const Value& function);
  /// The function with this number. Throws Error if there is none.
  const Value& at(std::uint64_t number) const;
  /// The numbers of the costs.
  std::vector<std::uint64_t> costs() const;

  /// The reply to a question about one of them: {"function": number, "changes": [...], "do": ..., ...}. The
  /// changes are numbers: of a cost the levels, of a projector of radiographs how much it is smoothed, one after the
  /// other. Throws Error if there is no such function, and what the function throws. python/bindings/asked.cpp is the
  /// other side.
  nlohmann::json reply(const nlohmann::json& question, const AskProcess& ask_process) const;

 private:
  /// The function that is asked, with its changes; null if it has none with them.
  template <class Function>
  const Function* asked(const nlohmann::json& question) const;

  std::map<std::uint64_t, Value> functions_;
  mutable std::mutex mutex_;
  mutable std::map<std::string, std::shared_ptr<const void>> changed_;  ///< functions with the changes asked for
};

/// Whether nodes written in Python can take functions of this type.
bool can_be_asked(const TypeInfo& type);

/// What a projector gives. Lists of floating-point numbers are bytes in base64.
nlohmann::json asked_of(const OutlineProjector& projector, const nlohmann::json& question);
nlohmann::json asked_of(const RadiographProjector& projector, const nlohmann::json& question);

/// A transform as 12 numbers: the first three rows of its matrix.
nlohmann::json json_of_transform(const RigidTransform& transform);
/// The inverse. Throws Error unless there are 12 numbers of a rigid transform from the CT to the world.
std::vector<RigidTransform> transforms_of(const nlohmann::json& numbers);

}  // namespace marrow
