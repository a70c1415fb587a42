// SPDX-License-Identifier: Apache-2.0
#include "cluster/scripts.hpp"

#include <algorithm>
#include <cctype>

#include "marrow/base/number_text.hpp"
#include "marrow/base/text_file.hpp"
#include "process.hpp"
#include "report/report.hpp"

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

bool is_name_of_setting(const std::string& name) {
  return name.starts_with("MARROW_") && std::all_of(name.begin(), name.end(), [](unsigned char c) {
           return c == '_' || (c < 128 && std::isalnum(c));
         });
}

/// The settings of marrow in this process's environment, as lines of shell. Paths in them may start at the folder in
/// which this process runs.
std::string settings_of_marrow() {
  std::vector<std::string> lines;
  for (char** one = environ; *one; ++one)
    if (const std::string text = *one, name = text.substr(0, text.find('=')); is_name_of_setting(name))
      lines.push_back("export " + name + "=" + script_word(text.substr(std::min(text.size(), name.size() + 1))) + "\n");
  std::sort(lines.begin(), lines.end());
  std::error_code error;
  const std::string here = script_word(fs::current_path(error).string());
  std::string text = error ? "" : "if [ -d " + here + " ]; then cd " + here + "; fi\n";
  for (const std::string& line : lines) text += line;
  return text;
}

/// A list in Python. Names of chunks have letters, digits and hyphens only.
std::string python_list(const std::vector<Chunk>& chunks) {
  std::string list;
  for (const Chunk& chunk : chunks) list += (list.empty() ? "\"" : ", \"") + chunk.name + "\"";
  return "[" + list + "]";
}

const std::string kStartOfParallel = R"(#!/bin/sh
# Runs the chunks of a comparison by GNU parallel, one at a time on each host, and makes the report. Arguments go to
# parallel, such as -S host1,host2. The same command goes on after an interruption.
case ${TMPDIR-} in *[!A-Za-z0-9_.,:/+@-]*)
  echo "GNU parallel gives TMPDIR, $TMPDIR, to a shell and does not quote it. Set it to a folder whose name" \
    "has letters, digits and _ . , : / + @ - only." >&2
  exit 2 ;;
esac
)";

/// What a Snakefile does before its rules. Its executors put the names of folders into commands without quoting them
/// for the shell.
const std::string kStartOfSnakefile = R"(import os, re

if not getattr(workflow, "run_local", True):
    for folder, advice in (
        (os.getcwd(), "start it in another folder"),
        (os.path.dirname(workflow.basedir), "choose another folder with --out"),
    ):
        if not re.fullmatch("[A-Za-z0-9_.,:/+@-]+", folder):
            raise WorkflowError(
                "Snakemake gives the name of the folder %r to a shell when it submits jobs, and does not quote it. So "
                "it may hold letters, digits and _ . , : / + @ - only; %s, or let Snakemake run on this machine, by "
                "--cores" % (folder, advice)
            )

workdir: os.path.dirname(workflow.basedir)

)";

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
  text += "exec " + script_word(this_program().string()) + " chunk " + script_word(plan.place().string()) + " \"$@\"\n";
  return write_script(beside(plan, "chunk.sh"), text);
}

fs::path write_gather_script(const ClusterPlan& plan, const std::vector<std::string>& more) {
  std::string text = "#!/bin/sh\n# Makes tables and report of a comparison from the existing rows.\nset -e\n" +
                     settings_of_marrow() + "exec " + script_word(this_program().string()) + " compare " +
                     script_word(plan.file.string()) + " --out " + script_word(plan.folder.string()) + " --gather";
  for (const std::string& word : more) text += " " + script_word(word);
  return write_script(beside(plan, "gather.sh"), text + "\n");
}

std::string emit_parallel(const ClusterPlan& plan) {
  write_chunk_script(plan, {});
  write_gather_script(plan);
  std::string text = kStartOfParallel + "MARROW_COMPARISON=" + script_word(plan.folder.string()) +
                     "\nexport MARROW_COMPARISON\nplan=$MARROW_COMPARISON/plans/" + plan.id + "\n";
  for (const auto& [name, chunks] : {std::pair("cases", &plan.cases), std::pair("chunks", &plan.cells)}) {
    if (chunks->empty()) continue;
    const std::string list = std::string("-") + name;
    write_list(beside(plan, std::string(name) + ".txt"), *chunks);
    text += "parallel --env MARROW_COMPARISON --jobs 1 --retries 2 --resume-failed --joblog \"$plan" + list +
            "-log.txt\" \\\n  \"$@\" 'cd \"$MARROW_COMPARISON\" && exec plans/" + plan.id +
            "-chunk.sh' {} --quiet :::: \"$plan" + list + ".txt\"\n";
  }
  text += "exec \"$plan-gather.sh\"\n";
  return shell_word(write_script(beside(plan, "parallel.sh"), text).string());
}

std::string emit_snakemake(const ClusterPlan& plan, const ClusterProfile& profile) {
  write_chunk_script(plan, profile);
  write_gather_script(plan);
  const std::string script = "plans/" + plan.id;
  const std::string text = formatted(
      "# Runs the chunks of a comparison by Snakemake, and makes the report. Cases are made first.\n{}CASES = "
      "{}\nCHUNKS = {}\n\nlocalrules: gather\n\nrule gather:\n    input: [f\"rows/{{chunk}}.jsonl\" for chunk in "
      "CHUNKS]\n    shell: \"{}-gather.sh\"\n\nrule chunk:\n    input: lambda wildcards: [] if wildcards.chunk in "
      "CASES else [f\"rows/{{one}}.jsonl\" for one in CASES]\n    output: \"rows/{{chunk}}.jsonl\"\n    "
      "wildcard_constraints: chunk=\"{}-[a-z0-9-]+\"\n    threads: {}\n    retries: {}\n    shell: \"{}-chunk.sh "
      "{{wildcards.chunk}} --quiet --jobs {{threads}}\"\n\n# If chunks failed, the rule gather does not "
      "run.\nonerror:\n    if not all(os.path.exists(f\"rows/{{chunk}}.jsonl\") for chunk in CHUNKS):\n        "
      "shell(\"{}-gather.sh || true\")\n",
      kStartOfSnakefile, python_list(plan.cases), python_list(plan.cells), script, plan.id,
      std::max<std::int64_t>(1, profile.processors), profile.tries - 1, script, script);
  const fs::path file = beside(plan, "Snakefile");
  write_text_file(file, text);
  return "snakemake --snakefile " + shell_word(file.string()) + " --keep-going --cores all";
}

}  // namespace marrow::cli
