// SPDX-License-Identifier: Apache-2.0
#pragma once
// The inputs that a person gave to each pipeline last, in .marrow/inputs.json of the opened folder. The page offers
// them again. A browser could not keep them: each start of the server has another port, and so another place for it.
#include <mutex>

#include "workbench/opened_folder.hpp"

namespace marrow::workbench {

class KeptInputs {
 public:
  explicit KeptInputs(const OpenedFolder& folder) : folder_(folder) {}
  /// {name: text}; empty if nothing is kept, or if the file is damaged.
  nlohmann::json of(const std::string& file) const;
  /// What cannot be written is not kept.
  void keep(const std::string& file, const nlohmann::json& inputs);

 private:
  nlohmann::json all() const;

  const OpenedFolder& folder_;
  mutable std::mutex mutex_;
};

}  // namespace marrow::workbench
