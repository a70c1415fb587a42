// SPDX-License-Identifier: Apache-2.0
#include "commands.hpp"

#if defined(__GLIBC__)
#include <malloc.h>
#endif

namespace {

/// Nodes ask for images and volumes again and again. The C library would give each back to the system at once and have
/// its pages cleared anew, which takes a tenth of the time of a registration.
void keep_freed_memory() {
#if defined(__GLIBC__)
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 512 << 20);
#endif
}

}  // namespace

int main(int argc, char** argv) {
  using namespace marrow::cli;
  keep_freed_memory();
  return run_program(
      argc, argv,
      {add_run,        add_compare, add_cell,    add_chunk,       add_worker,       add_rerun,    add_replay,  add_diff,
       add_show,       add_recipe,  add_check,   add_plan,        add_cache,        add_list,     add_inspect, add_new,
       add_graph,      add_schema,  add_doctor,  add_conformance, add_check_worker, add_describe, add_watch,   add_open,
       add_completion, add_manual,  add_version, add_export,      add_curves,       add_data});
}
