# SPDX-License-Identifier: Apache-2.0
"""A page for each command, made from its help text."""
from markdown import block, entry, plain, section, sections, table, toctree


def page_of(name):
    return name.replace(" ", "-")


def rows_part(command, part):
    entries = []
    for given, told in command.rows(part):
        names, _, value = given.partition(" ")
        names = names.split("=")[0].split(",")
        shown = " ".join([*("or " + name for name in names[:-1]), value]).strip()
        entries.append(entry("command-option", command.name + " " + names[-1], shown, plain(told)))
    return sections(*entries)


def subcommands_table(command):
    rows = [
        ["[%s](%s.md)" % (name, page_of(command.name + " " + name)), plain(told)]
        for name, told in command.rows("Subcommands")
    ]
    return table(["command", "what it does"], rows)


def mentions_part(mentions):
    return "\n".join("- [%s](../%s.md)" % (plain(title), page) for page, title in mentions)


def command_page(command, documents):
    """`documents` are (page, title) of those that show the command."""
    return sections(
        "# marrow " + command.name,
        plain(command.summary[:1].upper() + command.summary[1:]) + ".",
        block(command.usage, "bash"),
        section("Commands", subcommands_table(command)),
        section("What is given", rows_part(command, "Positionals")),
        section("Options", rows_part(command, "Options")),
        section("Read more", mentions_part(documents)),
    )


def documents_that_show(name, documents):
    found = []
    for page, text in documents.items():
        if "marrow %s " % name in text.replace("\n", " ").replace("`", " "):
            title = next(line for line in text.splitlines() if line.startswith("# "))[2:]
            found.append((page, title))
    return found


def write(catalogue, facts, folder):
    """Writes commands/NAME.md for each command, and commands/index.md."""
    (folder / "commands").mkdir(parents=True)
    rows = []
    for name, command in catalogue.commands.items():
        page = command_page(command, documents_that_show(name, facts.documents))
        (folder / "commands" / (page_of(name) + ".md")).write_text(page)
        rows.append(["[marrow %s](%s.md)" % (name, page_of(name)), plain(command.summary)])
    pages = [page_of(name) for name in catalogue.commands]
    text = sections("# Commands", table(["command", "what it does"], rows), toctree(pages))
    (folder / "commands" / "index.md").write_text(text)
