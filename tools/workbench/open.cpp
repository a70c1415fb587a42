// SPDX-License-Identifier: Apache-2.0
// `marrow open`: the workbench in the browser.
#include <fcntl.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>

#include "command_options.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/text_file.hpp"
#include "process.hpp"
#include "workbench/workbench.hpp"

namespace fs = std::filesystem;

namespace marrow::workbench {
namespace {

using namespace cli;

struct OpenRequest {
  fs::path place = ".";
  int port = 0;
  bool no_browser = false;
};

/// The opened folder, and the page that is shown first, as the part of the address behind '#'.
struct Target {
  fs::path folder;
  std::string page;
};

std::string encoded(const std::string& text) {
  std::string result;
  for (const char c : text) {
    result += std::isalnum(static_cast<unsigned char>(c)) || c == '/' || c == '-' || c == '_' || c == '.'
                  ? std::string(1, c)
                  : formatted("%{:02X}", static_cast<unsigned char>(c));
  }
  return result;
}

/// For a case, a run or a comparison, opens the folder around it, because a case may name files there. The page shows
/// it at once.
Target target_of(const fs::path& place) {
  std::error_code error;
  const fs::path full = fs::canonical(place, error);
  if (error) throw Error(printable(place.string()) + ": " + error.message());
  if (fs::is_directory(full)) {
    for (const auto& [file, page] :
         {std::pair("case.yaml", "case"), std::pair("run.json", "results"), std::pair("comparison.json", "results")})
      if (fs::exists(full / file) && full.has_parent_path())
        return {full.parent_path(), "#" + std::string(page) + "=" + encoded(full.filename().string())};
    return {full, ""};
  }
  if (full.filename() == "case.yaml") return target_of(full.parent_path());
  if (full.extension() == ".yaml") expect_given(place, Wanted::pipeline);
  if (full.extension() == ".yaml") return {full.parent_path(), "#pipeline=" + encoded(full.filename().string())};
  throw Error(printable(place.string()) + ": open a folder, a case.yaml or a pipeline");
}

/// Starts the desktop's browser and does not wait for it. Silent if there is none: the address is printed anyway.
void start_browser(const std::string& address) {
  const pid_t child = fork();
  if (child != 0) {
    if (child > 0) waitpid(child, nullptr, 0);
    return;
  }
  if (fork() != 0) _exit(0);  // the browser loses its parent, and outlives marrow
  setsid();
  const int nothing = ::open("/dev/null", O_RDWR);
  for (const int stream : {0, 1, 2}) dup2(nothing, stream);
  execlp("xdg-open", "xdg-open", address.c_str(), nullptr);
  _exit(127);
}

/// Large blocks go back to the system when they are freed. Otherwise glibc keeps them in the heap of each thread that
/// answers, and seldom uses aligned blocks again (glibc bug 14581): the server would grow by megabytes with each
/// request.
void give_large_blocks_back() {
#ifdef __GLIBC__
  constexpr int kLarge_bytes = 4 << 20;
  mallopt(M_MMAP_THRESHOLD, kLarge_bytes);
#endif
}

int open(const OpenRequest& request) {
  give_large_blocks_back();
  const std::atomic<bool>& stop = stop_on_signals();
  const Target target = target_of(request.place);
  Server server;
  Workbench bench(target.folder);
  remove_unused_working_files(bench.folder);
  for (const auto add : {
           add_shell, add_case_page, add_ct_page, add_xray_page,  //
           add_place_page, add_pipeline_page, add_results_page,   //
       })
    add(server, bench);
  server.listen(request.port);
  const std::string address = server.access().address(target.page);
  std::printf("%s is open at\n\n  %s\n\nThe address works once, in one browser. Ctrl-C ends.\n",
              printable(target.folder.string()).c_str(), address.c_str());
  std::fflush(stdout);
  if (!request.no_browser) start_browser(address);
  server.run(stop);
  std::fprintf(stderr, "closed; %s\n", stopped_text().c_str());
  return 0;
}

}  // namespace

void add_open(CLI::App& app, int& code) {
  const auto request = std::make_shared<OpenRequest>();
  CLI::App* command = app.add_subcommand(
      "open", "open a folder in the browser: make cases, place bones, edit pipelines, look at results");
  command->add_option("place", request->place, "folder, case.yaml or pipeline (default: this folder)")
      ->type_name("PATH");
  show_default(add_whole_number(command, "--port", request->port, "port at 127.0.0.1; 0: any that is free", 0, 65535),
               request->port);
  command->add_flag("--no-browser", request->no_browser, "only print the address");
  command->callback([request, &code] { code = open(*request); });
  say_that_libraries_are_described(command);
}

}  // namespace marrow::workbench
