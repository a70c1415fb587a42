// SPDX-License-Identifier: Apache-2.0
// Bytes that no archive ever took: refused with a sentence, without undefined behaviour and without much memory.
#include "marrow/base/archive.hpp"

#include <sys/resource.h>

#include <random>

#include "marrow/runtime/node/types.hpp"
#include "tests/harness/message_of.hpp"

namespace archive_test {

enum class Side : std::int8_t { left, right };
bool is_valid(Side side) { return side == Side::left || side == Side::right; }

struct alignas(512) Item {  // takes more memory than packed
  std::string name;
  bool is_seen = false;
  Side side = Side::left;
  std::optional<double> value;
  using fields = marrow::Fields<&Item::name, &Item::is_seen, &Item::side, &Item::value>;
};

using marrow::Packer;
using marrow::Unpacker;

template <class T>
std::string packed(const T& value) {
  Packer packer;
  packer.add(value);
  return packer.packed;
}

template <class T>
std::string fault_of(const std::string& bytes) {
  return marrow::test::message_of([&] { Unpacker(bytes).get<T>(); });
}

TEST(Archive, ReadsBackWhatItTook) {
  const Item item{"name", true, Side::right, 2.5};
  const Item back = Unpacker(packed(item)).get<Item>();
  EXPECT_EQ(back.name, "name");
  EXPECT_TRUE(back.is_seen);
  EXPECT_EQ(back.side, Side::right);
  EXPECT_EQ(back.value, 2.5);
  EXPECT_EQ(Unpacker(packed(std::vector<bool>{true, false, true})).get<std::vector<bool>>(),
            (std::vector<bool>{true, false, true}));
}

TEST(Archive, ATruthValueAndAChoiceAreOnesThatThereAre) {
  EXPECT_EQ(fault_of<bool>(std::string(1, '\2')), "the packed value holds a truth value that is neither 0 nor 1");
  EXPECT_EQ(fault_of<std::optional<int>>(std::string(5, '\7')),
            "the packed value holds a truth value that is neither 0 nor 1");
  EXPECT_EQ(fault_of<Side>(std::string(1, '\2')), "the packed value holds an unknown choice");
  EXPECT_EQ(fault_of<Side>(std::string(1, '\1')), "");
}

TEST(Archive, ALengthIsNoLeaveToTakeMemory) {
  // A million items, as far as one megabyte can claim; the second has no truth value.
  std::string bytes = packed(std::uint64_t(1000000)) + std::string(1000000, '\0');
  bytes[8 + 11 + 8] = '\2';
  rusage before{}, after{};
  getrusage(RUSAGE_SELF, &before);
  EXPECT_EQ(fault_of<std::vector<Item>>(bytes), "the packed value holds a truth value that is neither 0 nor 1");
  getrusage(RUSAGE_SELF, &after);
  EXPECT_LT(after.ru_maxrss - before.ru_maxrss, 50000) << "kB; 400 MB where each is given its room before it is read";
  for (std::uint64_t count : {~std::uint64_t(0), std::uint64_t(1) << 61, std::uint64_t(100)}) {
    EXPECT_EQ(fault_of<std::vector<double>>(packed(count)), "the packed value ends too early");
    EXPECT_EQ(fault_of<std::string>(packed(count)), "the packed value ends too early");
    EXPECT_EQ((fault_of<std::map<std::string, int>>(packed(count))), "the packed value ends too early");
  }
}

TEST(Archive, AMatrixIsOfTheSizeOfItsType) {
  const auto matrix = [](std::int64_t rows, std::int64_t columns) {
    return packed(rows) + packed(columns) + std::string(72, '\0');
  };
  EXPECT_EQ(fault_of<Eigen::Matrix3d>(matrix(3, 3)), "");
  EXPECT_EQ(fault_of<Eigen::Matrix3d>(matrix(1, 9)), "the packed value holds a matrix of another size");
  const std::int64_t most = std::numeric_limits<std::int64_t>::max();
  for (const auto& [rows, columns] :
       {std::pair<std::int64_t, std::int64_t>{most, 0}, {0, most}, {most, most}, {-1, -1}, {1 << 20, 1 << 20}, {10, 1}})
    EXPECT_EQ(fault_of<Eigen::MatrixXd>(matrix(rows, columns)), "the packed value holds a matrix of another size")
        << rows << " " << columns;
}

template <class T>
void expect_that_any_bytes_do(const T& value, std::mt19937& chance) {
  const std::string good = packed(value);
  for (int round = 0; round < 3000; ++round) {
    std::string bad = good;
    for (unsigned change = 0; change <= chance() % 4; ++change)
      bad[chance() % bad.size()] = char(chance() % 3 ? chance() : 0xff);
    if (chance() % 4 == 0) bad.resize(chance() % bad.size());
    fault_of<T>(bad);
  }
}

TEST(Archive, AnyBytesAreAValueOrASentence) {
  std::mt19937 chance(1);
  marrow::View view{"frontal", {cv::Mat(6, 8, CV_16U, cv::Scalar(3))}, {}, {}};
  marrow::Pose pose;
  pose.warnings = {"one", "two"};
  expect_that_any_bytes_do(view, chance);
  expect_that_any_bytes_do(pose, chance);
  expect_that_any_bytes_do(marrow::Mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}, "ct"}, chance);
  expect_that_any_bytes_do(std::vector<Item>(5, {"name", true, Side::right, 2.5}), chance);
}

}  // namespace archive_test
