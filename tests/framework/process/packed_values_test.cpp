// SPDX-License-Identifier: Apache-2.0
// Values that one process hands to another, read back from files that are not as they should be.
#include "marrow/runtime/process/packed_values.hpp"

#include <fcntl.h>
#include <unistd.h>

#include "tests/framework/fixture.hpp"

namespace packed_values_test {

using marrow::Metrics;
using marrow::Value;
using runtime_fixture::Scratch;

Value some_metrics() { return Value::of<Metrics>(std::make_shared<const Metrics>(Metrics{{{"a", 1.5, "mm"}}})); }

std::string refusal(int descriptor) {
  return marrow::test::message_of([&] { marrow::read_values(descriptor, getpid(), marrow::content_of_own); });
}

TEST(PackedValues, ComeBack) {
  const marrow::SharedMemory memory;
  marrow::write_values(memory.descriptor(), {some_metrics()}, true);
  const std::vector<Value> values = marrow::read_values(memory.descriptor(), getpid(), marrow::content_of_own);
  ASSERT_EQ(values.size(), 1u);
  EXPECT_EQ(values[0].as<Metrics>().items.at(0).value, 1.5);
}

TEST(PackedValues, AFileThatCannotBeReadIsSaidToBeOne) {
  Scratch scratch;
  const int descriptor = open(scratch.write("values", "bytes").c_str(), O_WRONLY | O_CLOEXEC);
  ASSERT_GE(descriptor, 0);
  EXPECT_EQ(refusal(descriptor), "another process handed over nothing");
  close(descriptor);
}

TEST(PackedValues, AFileThatEndsEarlyIsDamaged) {
  const marrow::SharedMemory memory;
  marrow::write_values(memory.descriptor(), {some_metrics()}, true);
  const auto whole = off_t(marrow::bytes_in(memory.descriptor()));
  for (const off_t size : {off_t(0), off_t(1), whole / 2, whole - 1}) {
    ASSERT_EQ(ftruncate(memory.descriptor(), size), 0);
    EXPECT_EQ(refusal(memory.descriptor()), "what the other process handed over is damaged") << size << " bytes";
    ASSERT_EQ(ftruncate(memory.descriptor(), 0), 0);
    ASSERT_EQ(lseek(memory.descriptor(), 0, SEEK_SET), 0);
    marrow::write_values(memory.descriptor(), {some_metrics()}, true);
  }
}

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

}  // namespace packed_values_test
