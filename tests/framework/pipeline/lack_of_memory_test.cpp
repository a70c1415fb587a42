// SPDX-License-Identifier: Apache-2.0
// Each allocation fails once: first the first, then the second, and so on. Each time std::bad_alloc is thrown, and
// nothing crashes.
#include <new>

#include "marrow/runtime/plugins/manifest.hpp"
#include "tests/framework/fixture.hpp"

namespace {
long allocations_left = -1;  // until an allocation fails; -1: none fails
}

[[gnu::noinline]] void* operator new(std::size_t size) {
  if (allocations_left >= 0 && allocations_left-- == 0) throw std::bad_alloc();
  void* data = std::malloc(size ? size : 1);
  if (!data) throw std::bad_alloc();
  return data;
}
[[gnu::noinline]] void operator delete(void* data) noexcept { std::free(data); }
[[gnu::noinline]] void operator delete(void* data, std::size_t) noexcept { std::free(data); }

namespace {

/// Repeats the work until no allocation fails in it any more. Returns how many repetitions had a failed allocation.
long failures_of(const std::function<void()>& work) {
  for (long n = 0;; ++n) {
    allocations_left = n;
    try {
      work();
      const bool done = allocations_left >= 0;
      allocations_left = -1;
      if (done) return n;
    } catch (const std::exception& error) {
      const bool done = allocations_left >= 0;
      allocations_left = -1;
      if (done) {
        ADD_FAILURE() << error.what();
        return n;
      }
    }
  }
}

TEST(LackOfMemory, WhileAManifestIsRead) {
  marrow::LibraryInfo library;
  marrow::NodeInfo node;
  node.name = "test.texts";
  node.summary = "Has options whose defaults need memory";
  node.options.resize(3);
  const char* const names[] = {"text", "numbers", "texts"};
  for (int i = 0; i < 3; ++i) node.options[i].name = names[i], node.options[i].help = "an option with a default";
  node.options[0].type = marrow::OptionType::text;
  node.options[0].default_value = std::string("a text too long to be kept without memory");
  node.options[1].type = marrow::OptionType::numbers;
  node.options[1].default_value = std::vector<double>{1, 2, 3};
  node.options[2].type = marrow::OptionType::texts;
  node.options[2].default_value = std::vector<std::string>{"a text too long to be kept without memory", "b"};
  node.outputs.resize(1);
  node.outputs[0].name = "value", node.outputs[0].help = "a value";
  node.outputs[0].type.id = "metrics", node.outputs[0].type.version = 1, node.outputs[0].type.size = 24;
  library.nodes.push_back(std::move(node));
  const std::string text = marrow::manifest_text(library);
  EXPECT_GT(failures_of([&] { marrow::manifest_from_text(text); }), 100);
}

TEST(LackOfMemory, WhileAPipelineIsRead) {
  const runtime_fixture::Scratch scratch;
  const auto file = scratch.write("p.yaml", "marrow: 1\nnodes:\n  a: {uses: test.constant}\noutputs: {a: a}\n");
  const marrow::Catalogue& catalogue = runtime_fixture::test_catalogue();
  EXPECT_GT(failures_of([&] {
              marrow::Diagnostics diagnostics;
              marrow::read_pipeline(file, {}, catalogue, diagnostics);
            }),
            100);
}

}  // namespace
