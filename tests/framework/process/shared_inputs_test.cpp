// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/process/shared_inputs.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include "marrow/runtime/node/types.hpp"

namespace {

using marrow::SharedInputs;
using Numbers = std::vector<std::uint64_t>;

marrow::Value volume_of(int count) {
  auto volume = std::make_shared<marrow::Volume>();
  volume->grid.size = {count, 1, 1};
  for (int i = 0; i < count; ++i) volume->values.push_back(float(i));
  return marrow::Value::of<marrow::Volume>(std::shared_ptr<const marrow::Volume>(volume));
}

TEST(SharedInputs, SamplesComeFirstAndThenTheRest) {
  SharedInputs inputs(1 << 20);
  const auto shared = inputs.share(volume_of(5));
  EXPECT_EQ(shared->samples_bytes, 20u);
  std::vector<float> samples(5);
  ASSERT_EQ(pread(shared->memory.descriptor(), samples.data(), 20, 0), 20);
  EXPECT_EQ(samples, (std::vector<float>{0, 1, 2, 3, 4}));
  std::string rest(shared->bytes - 20, '\0');
  ASSERT_EQ(pread(shared->memory.descriptor(), rest.data(), rest.size(), 20), ssize_t(rest.size()));
  marrow::Unpacker packed{std::string_view(rest)};
  EXPECT_EQ(packed.get<marrow::Volume>().grid.size[0], 5);
  EXPECT_EQ(packed.remaining(), 0u);
}

TEST(SharedInputs, AValueIsPackedOnceWhileItLives) {
  SharedInputs inputs(1 << 20);
  marrow::Value value = volume_of(5);
  const auto first = inputs.share(value);
  EXPECT_EQ(inputs.share(value), first);
  EXPECT_EQ(inputs.share(marrow::Value(value)), first);
  EXPECT_NE(inputs.share(volume_of(5))->number, first->number);  // this one is gone at once
  value = volume_of(5);
  EXPECT_NE(inputs.share(value)->number, first->number);
  EXPECT_EQ(inputs.numbers(), Numbers{3});
}

TEST(SharedInputs, WhatWasNotUsedForLongestGoesWhenThereIsNoMoreRoom) {
  const marrow::Value a = volume_of(1000), b = volume_of(1000), c = volume_of(1000), large = volume_of(100000);
  SharedInputs inputs(10000);  // two of about 4200 bytes
  inputs.share(a);
  inputs.share(b);
  inputs.share(a);
  EXPECT_EQ(inputs.numbers(), (Numbers{1, 2}));
  inputs.share(c);
  EXPECT_EQ(inputs.numbers(), (Numbers{3, 1}));
  inputs.share(large);  // it is needed now, so it is kept
  EXPECT_EQ(inputs.numbers(), Numbers{4});
}

}  // namespace
