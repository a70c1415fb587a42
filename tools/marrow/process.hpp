// SPDX-License-Identifier: Apache-2.0
#pragma once
// The process and what surrounds it: its streams, its signals, and its last words.
#include <atomic>
#include <string>

namespace marrow::cli {

/// At the start of main(): streams that the caller closed are opened on /dev/null, so that no file of ours takes their
/// place, and neither a reader that goes away nor a limit of file sizes ends the process; both are errors of a write
/// instead.
void prepare_process();

/// What to return from main() instead of this code: 1 where all went well but for what was printed, which the caller
/// did not get. A reader that went away wanted no more, and is no fault.
int with_output_written(int code);

/// From here on SIGINT, SIGTERM and SIGHUP ask to stop, which this flag then says; a second one ends the process at
/// once.
const std::atomic<bool>& stop_on_signals();

/// "stopped by Ctrl-C", or what else asked to stop.
std::string stopped_text();

}  // namespace marrow::cli
