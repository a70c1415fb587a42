// SPDX-License-Identifier: Apache-2.0
// Which kept result a plan compares with. The differences were counted by hand.
#include <gtest/gtest.h>

#include "marrow/runtime/run/evaluation.hpp"
#include "marrow/runtime/run/keys.hpp"

namespace nearest_result_test {

using marrow::Digest;
using marrow::Provenance;
using marrow::Store;

Store::Last made(std::uint64_t key, const std::string& low, const std::string& high, std::uint64_t image) {
  Provenance from;
  from.node = "edges.canny";
  from.options = {{"low", low}, {"high", high}};
  from.inputs = {{"image", Digest{image, 0}}};
  return {Digest{key, 0}, from};
}

std::string reason(const std::vector<Store::Last>& kept, const Store::Last& last, const Store::Last& now) {
  const Provenance* nearest = marrow::nearest_result(kept, last, now.provenance);
  return nearest ? marrow::difference(*nearest, now.provenance) : "none";
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

TEST(NearestResult, AnInputThatDidNotChangeIsNoReason) {
  const Store::Last own = made(1, "10", "20", 1), of_other_view = made(2, "11", "21", 2);
  EXPECT_EQ(reason({own, of_other_view}, own, made(3, "11", "21", 1)),
            "option 'high' is 21, was 20; option 'low' is 11, was 10");
  EXPECT_EQ(reason({own, of_other_view}, own, made(3, "11", "22", 2)), "option 'high' is 22, was 21")
      << "the other image is given now";
  EXPECT_EQ(reason({of_other_view}, own, made(3, "11", "21", 1)), "input 'image' changed") << "there are no others";
}

TEST(NearestResult, OtherNodesDoNotCount) {
  Store::Last other = made(1, "10", "20", 1);
  other.provenance.node = "edges.gradient_mask";
  EXPECT_EQ(reason({other}, other, made(2, "10", "20", 1)), "none");
}

}  // namespace nearest_result_test
