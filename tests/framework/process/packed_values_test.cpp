// SPDX-License-Identifier: Apache-2.0
// Values that one process hands to another, read back from files that are not as they should be.
#include "marrow/runtime/process/packed_values.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "marrow/runtime/node/types.hpp"
#include "tests/framework/fixture.hpp"
#include "tests/harness/message_of.hpp"

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

}  // namespace packed_values_test
