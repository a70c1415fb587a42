// SPDX-License-Identifier: Apache-2.0
// The page of a watch. A page that was opened from a disk may not read files, but it may load scripts. So the state is
// a script, which the page loads again and again.
#include "page.hpp"

#include <chrono>
#include <nlohmann/json.hpp>

#include "marrow/base/text_file.hpp"

namespace marrow::cli {
namespace {

constexpr const char* kPage = R"(<!DOCTYPE html>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title></title>
<style>
  html, body { margin: 0; height: 100%; font: 14px system-ui, sans-serif; }
  body { display: flex; flex-direction: column; }
  #bar { padding: 6px 12px; background: #eef3f7; color: #223; }
  #fault { margin: 0; padding: 8px 12px; max-height: 40vh; overflow: auto; background: #fdecea; color: #7a1410;
    white-space: pre-wrap; font: 12px ui-monospace, monospace; }
  #fault:empty { display: none; }
  iframe { flex: 1; border: 0; width: 100%; }
  @media (prefers-color-scheme: dark) {
    #bar { background: #1d2730; color: #dde; }
    #fault { background: #3b1512; color: #f5b5ae; }
  }
</style>
<div id="bar" role="status">waiting for the first result</div>
<pre id="fault" role="alert"></pre>
<iframe title="report"></iframe>
<script>
  const title = TITLE, frame = document.querySelector('iframe'), bar = document.querySelector('#bar');
  let shown = '', seen = '', place = 0;
  document.title = title;
  frame.addEventListener('load', () => {
    try { frame.contentWindow.scrollTo(0, place); } catch (e) { /* the browser keeps the files apart */ }
  });
  function marrowState(state) {
    if (JSON.stringify(state) === seen) return;
    seen = JSON.stringify(state);
    bar.textContent = title + ': ' + (state.doing || (state.fault ? 'a fault; below is the last good result' :
      'up to date since ' + state.at)) ;
    document.querySelector('#fault').textContent = state.fault;
    document.title = (state.fault ? '✗ ' : state.doing ? '… ' : '✓ ') + title;
    if (state.report && state.report !== shown) {
      try { place = frame.contentWindow.scrollY; } catch (e) { place = 0; }
      shown = frame.src = state.report;
    }
  }
  function look() {
    const script = document.createElement('script');
    script.src = 'state.js?' + Date.now();
    script.onload = script.onerror = () => { script.remove(); setTimeout(look, 1000); };
    document.head.append(script);
  }
  look();
</script>
)";

}  // namespace

void write_page(const std::filesystem::path& folder, const std::string& title) {
  std::string page = kPage;
  // The text of a script must not contain the end of the element.
  std::string name = nlohmann::json(title).dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
  for (std::size_t at = 0; (at = name.find('<', at)) != std::string::npos;) name.replace(at, 1, "\\u003c");
  page.replace(page.find("TITLE"), 5, name);
  write_text_file(folder / "index.html", page);
}

void write_state(const std::filesystem::path& folder, const PageState& state) {
  const std::time_t now = std::time(nullptr);
  char clock[16];
  std::strftime(clock, sizeof clock, "%H:%M:%S", std::localtime(&now));
  const nlohmann::json json = {{"report", state.report}, {"doing", state.doing}, {"fault", state.fault}, {"at", clock}};
  write_text_file(folder / "state.js",
                  "marrowState(" + json.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace) + ")\n");
}

}  // namespace marrow::cli
