// SPDX-License-Identifier: Apache-2.0
// Atomic writing when memory runs out, at each allocation in turn.

#include <cstdlib>
#include <new>

#include "marrow/toolbox/files/atomic_write.hpp"
#include "tests/plugins/read/files.hpp"

namespace {

namespace fs = std::filesystem;

thread_local long left = -1;  // allocations until one fails; negative: none does

TEST(AtomicWrite, LeavesOldOrNewWhereAnAllocationFails) {
  const marrow::test::TemporaryFolder folder;
  fs::create_directories(folder / "with a longer name than fits into the text itself");
  for (const char* name : {"a", "with a longer name than fits into the text itself/and another one of that kind.txt"}) {
    const fs::path path = folder / name;
    marrow::files::write_text(path, "old");
    bool done = false;
    long number = 0;
    for (; !done; ++number) {
      ASSERT_LT(number, 1000);
      left = number;
      try {
        marrow::files::write_text(path, "new");
        done = left >= 0;  // none was left to fail
      } catch (const std::bad_alloc&) {
      } catch (const marrow::Error&) {
      }
      left = -1;
      const std::string found = marrow::test::bytes_of(path);
      EXPECT_TRUE(found == "new" || (!done && found == "old")) << name << ", allocation " << number << ": " << found;
      for (const fs::directory_entry& entry : fs::directory_iterator(path.parent_path()))
        EXPECT_NE(entry.path().filename().string().rfind(".tmp-", 0), 0u) << entry.path();
    }
    EXPECT_GT(number, 5);
  }
}

}  // namespace

void* operator new(std::size_t size) {
  if (left >= 0 && left-- == 0) throw std::bad_alloc();
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
