// SPDX-License-Identifier: Apache-2.0
// The requests of the page "Case" about the draft as a whole.
#include "workbench/workbench.hpp"

namespace marrow::workbench {

void add_case_page(Server& server, Workbench& workbench) {
  server.get("/api/draft",
             [&](const Request& request) { return json_answer(workbench.drafts.open(request.parameter("case"))); });
  server.post("/api/draft/change", [&](const Request& request) {
    return json_answer(workbench.drafts.change(request.text("case"), request.body.value("revision", -1),
                                               request.text("what"), request.body.value("document", nlohmann::json())));
  });
  server.post("/api/draft/undo", [&](const Request& request) {
    return json_answer(workbench.drafts.undo(request.text("case"), request.body.value("revision", -1)));
  });
  server.post("/api/draft/redo", [&](const Request& request) {
    return json_answer(workbench.drafts.redo(request.text("case"), request.body.value("revision", -1)));
  });
}

}  // namespace marrow::workbench
