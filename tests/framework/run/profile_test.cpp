// SPDX-License-Identifier: Apache-2.0
// What a profile notes of functions, and what it keeps when there are too many calls.
#include "marrow/runtime/run/profile.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "marrow/runtime/node/types.hpp"
#include "marrow/runtime/run/evaluation.hpp"

namespace profile_test {

using namespace marrow;
using nlohmann::json;

/// Tries the start and one step beyond it. Says whether it was given derivatives.
MinimisationResult two_tries(const MinimisationProblem& problem) {
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
  MinimisationResult minimise(const MinimisationProblem& problem) const override { return two_tries(problem); }
};

namespace {
class Hidden : public Optimizer {
 public:
  MinimisationResult minimise(const MinimisationProblem& problem) const override { return two_tries(problem); }
};
class HiddenWithExtra : public Named, public Extra {};

template <class Made>
Value value_of() {
  return Value::of<Optimizer>(std::make_shared<Made>());
}

MinimisationProblem square() {
  MinimisationProblem problem;
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
  const ProfilePlace place{&profile, "track/", "0007/"};
  Value value = value_of<Hidden>();
  show_calls(value, place, "search", "distal");
  MinimisationProblem problem = square();
  const auto result = value.as<Optimizer>().minimise(problem);
  EXPECT_EQ(result.x[0], 2);
  EXPECT_EQ(result.value, 1);
  EXPECT_EQ(result.stopped_because, "no derivatives");
  problem.expansion = [](const Eigen::VectorXd&) { return MinimisationProblem::Expansion{-5, {}, {}}; };
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
  const ProfilePlace place{&profile};
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

// Which kept result a plan compares with. The differences were counted by hand.

Store::Last made(std::uint64_t key, const std::string& low, const std::string& high, std::uint64_t image) {
  Provenance from;
  from.node = "edges.canny";
  from.options = {{"low", low}, {"high", high}};
  from.inputs = {{"image", Digest{image, 0}}};
  return {Digest{key, 0}, from};
}

std::string reason(const std::vector<Store::Last>& kept, const Store::Last& last, const Store::Last& now) {
  const Provenance* nearest = nearest_result(kept, last, now.provenance);
  return nearest ? difference(*nearest, now.provenance) : "none";
}

TEST(NearestResult, TheOneWithFewestDifferences) {
  const Store::Last first = made(1, "10", "20", 1), last = made(2, "50", "60", 1);
  EXPECT_EQ(reason({first, last}, last, made(3, "10", "25", 1)), "option 'high' is 25, was 20");
  EXPECT_EQ(reason({first, last}, last, made(3, "50", "25", 1)), "option 'high' is 25, was 60");
}

TEST(NearestResult, OfEquallyNearOnesTheLastAndThenTheLatest) {
  const Store::Last first = made(1, "10", "20", 1), second = made(2, "10", "30", 1), last = made(3, "10", "40", 1);
  const Store::Last now = made(4, "10", "50", 1);
  EXPECT_EQ(reason({first, last, second}, last, now), "option 'high' is 50, was 40");
  EXPECT_EQ(reason({first, second}, last, now), "option 'high' is 50, was 30") << "the last one failed";
}

TEST(NearestResult, AnInputThatDidNotChangeIsNoReasonNorAreOtherNodes) {
  const Store::Last own = made(1, "10", "20", 1), of_other_view = made(2, "11", "21", 2);
  EXPECT_EQ(reason({own, of_other_view}, own, made(3, "11", "21", 1)),
            "option 'high' is 21, was 20; option 'low' is 11, was 10");
  EXPECT_EQ(reason({own, of_other_view}, own, made(3, "11", "22", 2)), "option 'high' is 22, was 21")
      << "the other image is given now";
  EXPECT_EQ(reason({of_other_view}, own, made(3, "11", "21", 1)), "input 'image' changed") << "there are no others";
  Store::Last other = made(1, "10", "20", 1);
  other.provenance.node = "edges.gradient_mask";
  EXPECT_EQ(reason({other}, other, made(2, "10", "20", 1)), "none");
}

}  // namespace profile_test
