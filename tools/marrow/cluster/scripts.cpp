// SPDX-License-Identifier: Apache-2.0
#include "cluster/scripts.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "process.hpp"
#include "report/report.hpp"
#include "runtime/text_file.hpp"

extern char** environ;

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;

fs::path beside(const ClusterPlan& plan, const std::string& end) {
  return plan.folder / "plans" / (plan.id + "-" + end);
}

fs::path write_script(const fs::path& file, const std::string& text) {
  write_text_file(file, text);
  fs::permissions(file, fs::perms::owner_exec | fs::perms::group_exec, fs::perm_options::add);
  return file;
}

/// The settings of marrow in this process's environment, as lines of shell.
std::string settings_of_marrow() {
  std::vector<std::string> lines;
  for (char** one = environ; *one; ++one)
    if (const std::string text = *one; text.starts_with("MARROW_"))
      if (const std::size_t end = text.find('='); end != std::string::npos)
        lines.push_back("export " + text.substr(0, end) + "=" + shell_word(text.substr(end + 1)) + "\n");
  std::sort(lines.begin(), lines.end());
  std::string text;
  for (const std::string& line : lines) text += line;
  return text;
}

}  // namespace

void write_list(const fs::path& file, const std::vector<Chunk>& chunks) {
  std::string text;
  for (const Chunk& chunk : chunks) text += chunk.name + "\n";
  write_text_file(file, text);
}

fs::path write_chunk_script(const ClusterPlan& plan, const ClusterProfile& profile) {
  std::string text = "#!/bin/sh\n# Runs one chunk of a comparison: its name is the first argument.\nset -e\n";
  for (const std::string& module : profile.modules) text += "module load " + module + "\n";
  text += settings_of_marrow();
  for (const std::string& line : profile.setup) text += line + "\n";
  text += "exec " + shell_word(this_program().string()) + " chunk " + shell_word(plan.place().string()) + " \"$@\"\n";
  return write_script(beside(plan, "chunk.sh"), text);
}

std::string gather_command(const ClusterPlan& plan) {
  return shell_word(this_program().string()) + " compare " + shell_word(plan.file.string()) + " --out " +
         shell_word(plan.folder.string()) + " --gather";
}

std::string emit_parallel(const ClusterPlan& plan) {
  const fs::path script = write_chunk_script(plan, {}), cases = beside(plan, "cases.txt"),
                 cells = beside(plan, "chunks.txt");
  write_list(cases, plan.cases);
  write_list(cells, plan.cells);
  std::string text =
      "#!/bin/sh\n"
      "# Runs the chunks of a comparison by GNU parallel, one at a time on each host, and makes the report. Arguments "
      "go\n"
      "# to parallel, such as -S host1,host2. The same command goes on after an interruption.\n";
  for (const auto& [list, chunks] : {std::pair(cases, &plan.cases), std::pair(cells, &plan.cells)})
    if (!chunks->empty())
      text += "parallel --jobs 1 --retries 2 --resume-failed --joblog " +
              shell_word(beside(plan, list.stem().native().substr(plan.id.size() + 1) + "-log.txt").string()) +
              " \"$@\" " + shell_word(script.string()) + " {} --quiet :::: " + shell_word(list.string()) + "\n";
  text += "exec " + gather_command(plan) + "\n";
  return shell_word(write_script(beside(plan, "parallel.sh"), text).string());
}

std::string emit_snakemake(const ClusterPlan& plan, const ClusterProfile& profile) {
  const fs::path script = write_chunk_script(plan, profile);
  const auto names = [](const std::vector<Chunk>& chunks) {
    std::string list = "[";
    for (const Chunk& chunk : chunks) list += (list.size() > 1 ? ", " : "") + ("\"" + chunk.name + "\"");
    return list + "]";
  };
  // Braces have a meaning in `shell`, so commands come in as parameters.
  const auto text_of = [](const std::string& text) { return nlohmann::json(text).dump(); };
  const std::string text =
      "# Runs the chunks of a comparison by Snakemake, and makes the report. Cases are made first.\n"
      "CASES = " +
      names(plan.cases) + "\nCHUNKS = " + names(plan.cells) +
      "\n\n"
      "workdir: " +
      text_of(plan.folder.string()) +
      "\n\n"
      "localrules: gather\n\n"
      "rule gather:\n"
      "    input: [f\"rows/{chunk}.jsonl\" for chunk in CHUNKS]\n"
      "    output: \"report.html\"\n"
      "    params: command=" +
      text_of(gather_command(plan)) +
      "\n"
      "    shell: \"{params.command}\"\n\n"
      "rule chunk:\n"
      "    input: lambda wildcards: [] if wildcards.chunk in CASES else [f\"rows/{one}.jsonl\" for one in CASES]\n"
      "    output: \"rows/{chunk}.jsonl\"\n"
      "    wildcard_constraints: chunk=\"" +
      plan.id +
      "-[a-z0-9-]+\"\n"
      "    params: script=" +
      text_of(shell_word(script.string())) +
      "\n"
      "    threads: " +
      std::to_string(std::max<std::int64_t>(1, profile.processors)) +
      "\n"
      "    retries: " +
      std::to_string(profile.tries - 1) +
      "\n"
      "    shell: \"{params.script} {wildcards.chunk} --quiet --jobs {threads}\"\n";
  const fs::path file = beside(plan, "Snakefile");
  write_text_file(file, text);
  return "snakemake --snakefile " + shell_word(file.string()) + " --keep-going --cores all";
}

}  // namespace marrow::cli
