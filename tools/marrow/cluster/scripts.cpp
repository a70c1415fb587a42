// SPDX-License-Identifier: Apache-2.0
#include "cluster/cluster.hpp"

#include <algorithm>
#include <cctype>

#include "marrow/base/number_text.hpp"
#include "marrow/base/strict_yaml.hpp"
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

const std::vector<std::string> kKeys{"marrow-cluster", "partition", "account",   "processors", "memory_mb",
                                     "minutes",        "modules",   "setup",     "options",    "most_tasks",
                                     "most_at_once",   "tries",     "silence_s", "ask_every_s"};

class ProfileReader {
 public:
  ProfileReader(const std::filesystem::path& file, Diagnostics& diagnostics) : yaml_(file.string(), diagnostics) {}

  ClusterProfile read(const std::string& source, const Place& whole) {
    ClusterProfile profile;
    bool has_version = false;
    for (const YamlEntry& entry : yaml_.map(yaml_.parse(source), whole, "the profile", &kKeys)) {
      const std::string& key = entry.key;
      if (key == "marrow-cluster") has_version = number(entry, 1, 1) == 1;
      if (key == "partition") profile.partition = word(entry.value, entry);
      if (key == "account") profile.account = word(entry.value, entry);
      if (key == "processors") profile.processors = number(entry, 1, 100'000);
      if (key == "memory_mb") profile.memory_mb = number(entry, 1, 100'000'000);
      if (key == "minutes") profile.minutes = number(entry, 1, 1'000'000);
      if (key == "modules") profile.modules = words(entry);
      if (key == "setup") profile.setup = lines(entry);
      if (key == "options") profile.options = lines(entry);
      if (key == "most_tasks") profile.most_tasks = number(entry, 1, 1'000'000);
      if (key == "most_at_once") profile.most_at_once = number(entry, 1, 1'000'000);
      if (key == "tries") profile.tries = number(entry, 1, 100);
      if (key == "silence_s") profile.silence_s = number(entry, 1, 1'000'000);
      if (key == "ask_every_s") profile.ask_every_s = number(entry, 1, 3600);
    }
    if (!has_version) yaml_.fault(whole, "the profile lacks 'marrow-cluster: 1'");
    return profile;
  }

 private:
  std::int64_t number(const YamlEntry& entry, std::int64_t least, std::int64_t most) {
    const auto value = yaml_.integer(entry.value, entry.place, "'" + entry.key + "'");
    if (value && *value >= least && *value <= most) return *value;
    if (value)
      yaml_.fault(entry.place, formatted("'{}' must be from {} to {}, got {}", entry.key, least, most, *value));
    return least;
  }

  std::vector<std::string> lines(const YamlEntry& entry) {
    std::vector<std::string> all;
    if (!entry.value.IsSequence())
      yaml_.fault(entry.place, "'" + entry.key + "' must be a list of texts");
    else
      for (const YAML::Node& one : entry.value)
        if (auto text = yaml_.text(one, yaml_.place(one), "an item of '" + entry.key + "'")) {
          if (text->find_first_of("\n\r") != std::string::npos)
            yaml_.fault(yaml_.place(one), "an item of '" + entry.key + "' must be one line");
          all.push_back(std::move(*text));
        }
    return all;
  }

  /// The name of a partition, account or module. It becomes part of a line of shell, so only harmless characters are
  /// allowed.
  std::string word(const YAML::Node& node, const YamlEntry& entry) {
    const auto text = yaml_.text(node, entry.place, "'" + entry.key + "'");
    const char* allowed = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_.,:/+@-";
    if (text && (text->empty() || text->find_first_not_of(allowed) != std::string::npos))
      yaml_.fault(entry.place,
                  "'" + entry.key + "' may hold letters, digits and _ . , : / + @ - only, got '" + *text + "'");
    return text.value_or("");
  }
  std::vector<std::string> words(const YamlEntry& entry) {
    std::vector<std::string> all = lines(entry);
    for (const YAML::Node& one : entry.value)
      if (entry.value.IsSequence()) word(one, entry);
    return all;
  }

  StrictYaml yaml_;
};

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

ClusterProfile read_profile(const std::filesystem::path& file, Diagnostics& diagnostics) {
  const auto source = read_source(file, "the cluster's profile", diagnostics);
  if (!source) return {};
  return ProfileReader(file, diagnostics).read(*source, Place{file.string(), 1, 1});
}

}  // namespace marrow::cli
