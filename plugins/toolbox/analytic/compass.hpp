// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/domain/functions.hpp"

namespace marrow::analytic {

/// The plainest optimizer, for suites that give one to other nodes: it goes along one coordinate after the other, and
/// halves its steps when no coordinate leads down. It ignores bounds. Safe to call from several threads.
class Compass : public Optimizer {
 public:
  MinimisationResult minimise(const MinimisationProblem& problem) const override;
};

}  // namespace marrow::analytic
