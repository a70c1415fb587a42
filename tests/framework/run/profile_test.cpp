// SPDX-License-Identifier: Apache-2.0
// What a profile notes of functions, and what it keeps when there are too many calls.
#include "marrow/runtime/run/profile.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "marrow/domain/functions.hpp"
#include "marrow/runtime/node/types.hpp"
#include "marrow/runtime/run/profiled_functions.hpp"

namespace profile_test {

using marrow::Optimizer;
using marrow::Profile;
using marrow::Value;
using nlohmann::json;

/// Tries the start and one step beyond it. Says whether it was given derivatives.
marrow::MinimisationResult two_tries(const marrow::MinimisationProblem& problem) {
  const Eigen::VectorXd next = problem.start + problem.initial_step;
  double value = std::min(problem.function(problem.start), problem.function(next));
  if (problem.expansion) value = problem.expansion(next).value;
  return {next, value, 2, problem.expansion ? "derivatives" : "no derivatives"};
}

/// Something that other files could look for by dynamic_cast.
struct Extra {
  virtual ~Extra() = default;
};
class Named : public Optimizer {
 public:
  marrow::MinimisationResult minimise(const marrow::MinimisationProblem& problem) const override {
    return two_tries(problem);
  }
};

namespace {
class Hidden : public Optimizer {
 public:
  marrow::MinimisationResult minimise(const marrow::MinimisationProblem& problem) const override {
    return two_tries(problem);
  }
};
class HiddenWithExtra : public Named, public Extra {};

template <class Made>
Value value_of() {
  return Value::of<Optimizer>(std::make_shared<Made>());
}

marrow::MinimisationProblem square() {
  marrow::MinimisationProblem problem;
  problem.function = [](const Eigen::VectorXd& x) { return (x[0] - 3) * (x[0] - 3); };
  problem.start = Eigen::VectorXd::Zero(1);
  problem.initial_step = Eigen::VectorXd::Constant(1, 2);
  return problem;
}

json sum_of(const json& profile, const std::string& what) {
  for (const json& sum : profile["marrow"]["sums"])
    if (sum["what"] == what) return sum;
  return {};
}
}  // namespace

TEST(Profile, NotesTheEvaluationsOfAnOptimizer) {
  Profile profile;
  const marrow::ProfilePlace place{&profile, "track/", "0007/"};
  Value value = value_of<Hidden>();
  show_calls(value, place, "search", "distal");
  marrow::MinimisationProblem problem = square();
  const auto result = value.as<Optimizer>().minimise(problem);
  EXPECT_EQ(result.x[0], 2);
  EXPECT_EQ(result.value, 1);
  EXPECT_EQ(result.stopped_because, "no derivatives");
  problem.expansion = [](const Eigen::VectorXd&) { return marrow::MinimisationProblem::Expansion{-5, {}, {}}; };
  EXPECT_EQ(value.as<Optimizer>().minimise(problem).value, -5);

  const json made = json::parse(profile.text("p"));
  EXPECT_EQ(sum_of(made, "minimise")["calls"], 2);
  EXPECT_EQ(sum_of(made, "evaluation")["calls"], 4);
  EXPECT_EQ(sum_of(made, "evaluation with derivatives")["calls"], 1);
  EXPECT_EQ(sum_of(made, "evaluation")["node"], "track/search");
  EXPECT_EQ(made["traceEvents"].back()["args"]["item"], "0007/distal");
}

TEST(Profile, LeavesFunctionsWhoseClassOthersMayKnow) {
  Profile profile;
  for (Value value : {value_of<Named>(), value_of<HiddenWithExtra>()}) {
    const void* before = value.data.get();
    show_calls(value, {&profile}, "search", "");
    EXPECT_EQ(value.data.get(), before);
  }
}

TEST(Profile, CountsCallsThatHaveNoBar) {
  Profile profile;
  const marrow::ProfilePlace place{&profile};
  const std::size_t calls = Profile::kMostFunctionBars + 7;
  {
    const Profile::Bar node(place, Profile::Kind::node, "pose");
    for (std::size_t i = 0; i < calls; ++i)
      const Profile::Bar call(place, Profile::Kind::function, "drr", "", "radiograph");
  }
  EXPECT_EQ(profile.left_out(), 7u);
  EXPECT_EQ(note_on_profile(profile),
            "the profile has no bars for 7 later calls, because there were too many; its sums count them");
  const json made = json::parse(profile.text("p"));
  EXPECT_EQ(made["marrow"]["left_out"], 7);
  EXPECT_EQ(sum_of(made, "radiograph")["calls"], calls);
  const json node = sum_of(made, "");
  EXPECT_EQ(node["calls"], 1) << "the node's own bar is kept, though it ended last";
  EXPECT_NEAR(double(node["own_us"]) + double(sum_of(made, "radiograph")["us"]), double(node["us"]), 0.01);
}

TEST(Profile, SaysNothingIfAllCallsHaveBars) { EXPECT_EQ(note_on_profile(Profile()), ""); }

}  // namespace profile_test
