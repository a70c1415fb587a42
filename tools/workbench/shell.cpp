// SPDX-License-Identifier: Apache-2.0
// What all pages share: the page itself, the folder, and the jobs.
#include "workbench/workbench.hpp"

// The page, its script and its style. tools/report/page/bundle.py makes the latter two when marrow is built.
asm(".section .rodata\n"
    ".global marrow_workbench_html\n.global marrow_workbench_html_end\n"
    "marrow_workbench_html:\n.incbin \"" MARROW_WORKBENCH_HTML
    "\"\nmarrow_workbench_html_end:\n.byte 0\n"
    ".global marrow_workbench_js\n.global marrow_workbench_js_end\n"
    "marrow_workbench_js:\n.incbin \"" MARROW_WORKBENCH
    ".js\"\nmarrow_workbench_js_end:\n.byte 0\n"
    ".global marrow_workbench_css\n.global marrow_workbench_css_end\n"
    "marrow_workbench_css:\n.incbin \"" MARROW_WORKBENCH
    ".css\"\nmarrow_workbench_css_end:\n.byte 0\n"
    ".previous\n");
extern "C" const char marrow_workbench_html[], marrow_workbench_html_end[];
extern "C" const char marrow_workbench_js[], marrow_workbench_js_end[];
extern "C" const char marrow_workbench_css[], marrow_workbench_css_end[];

namespace marrow::workbench {

using nlohmann::json;

void add_shell(Server& server, Workbench& workbench) {
  server.page("/", "text/html; charset=utf-8", {marrow_workbench_html, marrow_workbench_html_end});
  server.page("/workbench.js", "text/javascript; charset=utf-8", {marrow_workbench_js, marrow_workbench_js_end});
  server.page("/workbench.css", "text/css; charset=utf-8", {marrow_workbench_css, marrow_workbench_css_end});
  server.get("/api/folder", [&](const Request&) {
    json contents = workbench.folder.contents();
    contents["folder"] = workbench.folder.path().string();
    return json_answer(contents);
  });
  server.get("/api/drafts", [&](const Request&) { return json_answer(workbench.drafts.unsaved()); });
  server.post("/api/draft/throw-away", [&](const Request& request) {
    workbench.drafts.throw_away(request.text("case"));
    return json_answer(json::object());
  });
  server.get("/api/listing",
             [&](const Request& request) { return json_answer(workbench.folder.listing(request.parameter("path"))); });
  server.get("/api/job", [&](const Request& request) {
    constexpr int kWait_ms = 5000;
    const int since = request.number("since", 0, 1'000'000);
    return json_answer(workbench.jobs.find(request.parameter("job"))->state(std::size_t(since), kWait_ms));
  });
  server.post("/api/job/stop", [&](const Request& request) {
    workbench.jobs.find(request.text("job"))->stop();
    return json_answer(json::object());
  });
}

}  // namespace marrow::workbench
