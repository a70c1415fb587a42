// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the tests of the store share: values to keep, and runs with their own store.
#include <sys/stat.h>
#include <unistd.h>

#include "marrow/runtime/store/store_folder.hpp"
#include "tests/framework/run_fixture.hpp"

namespace store_fixture {

using runtime_fixture::Scratch;
using runtime_fixture::test_catalogue;

template <class T>
marrow::Value kept_value(T item) {
  marrow::Value result = marrow::Value::of<T>(std::make_shared<const T>(std::move(item)));
  result.key = result.type.content->hash(result.data.get());
  return result;
}

inline marrow::Value number(double value) { return kept_value(marrow::Metrics{{{"value", value, "mm"}}}); }

inline marrow::Value many(std::size_t count) {
  marrow::Volume volume;
  volume.grid.size = {int(count), 1, 1};
  for (std::size_t i = 0; i < count; ++i) volume.values.push_back(float(i % 1000));
  return kept_value(std::move(volume));
}

inline mode_t mode_of(const std::filesystem::path& path) {
  struct stat status {};
  EXPECT_EQ(stat(path.c_str(), &status), 0) << path;
  return status.st_mode & 07777;
}

inline std::filesystem::path only_file(const std::filesystem::path& folder) {
  std::filesystem::path found;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    if (entry.is_regular_file() && entry.path().parent_path() != folder &&
        entry.path().parent_path().filename() != "last")
      found = entry.path();
  return found;
}

/// Starts a process that holds what `claim` returns while it does `work`. Returns its number once it has claimed.
template <class Claim, class Work>
pid_t claimer(const Claim& claim, const Work& work) {
  int pipe_ends[2];
  EXPECT_EQ(pipe(pipe_ends), 0);
  const pid_t child = fork();
  if (child == 0) {
    const auto held = claim();
    if (write(pipe_ends[1], "c", 1) != 1) _exit(1);
    work();
    _exit(0);
  }
  char told = 0;
  EXPECT_EQ(read(pipe_ends[0], &told, 1), 1);
  for (const int end : pipe_ends) close(end);
  return child;
}

class StoreTest : public run_fixture::RunTest {
 protected:
  marrow::RunResult run(const std::string& nodes, const std::string& outputs, std::uint64_t seed = 1) {
    settings.seed = seed;
    settings.store = &store;
    on_event = [this](const marrow::RunEvent& event) {
      if (event.kind == marrow::RunEvent::Kind::warning || event.kind == marrow::RunEvent::Kind::failed)
        messages += event.text + "\n";
    };
    return RunTest::run(nodes, outputs);
  }
  std::vector<marrow::PlannedNode> plan(const std::string& nodes, const std::string& outputs, std::uint64_t seed = 1) {
    read(nodes, outputs);
    marrow::RunSettings planning;
    planning.seed = seed;
    planning.store = &store;
    return marrow::plan_pipeline(pipeline, test_catalogue(), planning);
  }
  static int calls(const marrow::RunResult& result) {
    int sum = 0;
    for (const auto& node : result.nodes) sum += node.calls;
    return sum;
  }
  marrow::Store store{scratch.path / "store"};
  std::string messages;
};

}  // namespace store_fixture
