#!/usr/bin/env python3
"""Writes docs/reference/command-line.md, settings.md and errors.md from the texts of a built program.

    scripts/reference.py target/release/flockreel            writes the three pages
    scripts/reference.py target/release/flockreel --check    writes nothing; exit status 1 if a page differs

Commands, flags and settings come from `--help`. Parameters come from `/openapi.json`, and error codes from
`/docs/errors`, of a service that the script starts on a free port with an empty data folder.
"""
import argparse
import html
import json
import os
import re
import subprocess
import sys
import tempfile
import urllib.request
from pathlib import Path
from types import SimpleNamespace

PAGES = Path(__file__).resolve().parent.parent / "docs" / "reference"
NOTE = "`scripts/reference.py` writes this page from the texts of the program. Change those texts, not this page.\n"
# Without the settings of the caller, which `--help` would print.
ENVIRONMENT = {name: value for name, value in os.environ.items() if not name.startswith("FLOCKREEL_")}
# Nouns with parameters: command, schema of the parameters, and schema of a request, which has the presets.
NOUNS = [("an analysis", "analyze", "AnalysisParams", "AnalysisOverrides"),
         ("a flock", "flock", "FlockParams", "FlockOverrides"), ("a virtual fish", "fish", "FishParams", "FishRequest"),
         ("a data set", "dataset", "DatasetParams", "DatasetRequest")]
DEFAULTS = {"FLOCKREEL_WORKERS": "half of the cores, at least 1, plus one"}  # those that depend on the machine


def read(program, words=(), inherited=frozenset()):
    """Reads the help of a command, without the flags in `inherited`, and of the commands below it."""
    run = subprocess.run([program, *words, "--help"], env=ENVIRONMENT, check=True, capture_output=True, text=True)
    about, usage, rest = re.fullmatch(r"(.*?)\n+Usage: (.*?)\n(.*)", run.stdout, re.DOTALL).groups()
    parts = re.split(r"^(\S.*):\n", rest, flags=re.MULTILINE)
    sections = dict(zip(parts[1::2], parts[2::2]))
    names = re.findall(r"^  ([a-z-]+)", sections.pop("Commands", ""), re.MULTILINE)
    found = [item for text in sections.values() for item in items(text)]
    known = inherited | {item.term for item in found if item.term.startswith("-")}
    own = [item for item in found if item.term not in inherited]
    below = [read(program, (*words, name), known) for name in names if name != "help"]
    return SimpleNamespace(words=" ".join(words), about=about, usage=usage, items=own, commands=below)


def items(text):
    """Returns the arguments or flags of a section of help; each has its term, meaning, default and variable."""
    found = []
    for line in text.splitlines():
        if start := re.match(r" {2,6}([-<\[]\S.*?)(?: {2,}(.*))?$", line):
            found.append([start[1], [start[2] or ""]])
        elif found and line.strip():
            found[-1][1].append(line.strip())
    return [item(term, lines) for term, lines in found if not re.search("--(help|version)", term)]


def item(term, lines):
    values = [re.sub(r"^- (\S+?)(: +|$)", r"`\1`\2", line) for line in lines if line.startswith("- ")]
    prose = " ".join(line for line in lines if not line.startswith("- ") and line != "Possible values:")
    notes = dict(re.findall(r"\[(env|default|possible values): ([^]]*)\]", prose))
    prose = " ".join(re.sub(r"\[(env|default|possible values): .*?\]", "", prose).split())
    if choice := notes.get("possible values"):
        values.append(f"Values: {choice}")
    env = notes.get("env", "").rstrip("=")
    default = DEFAULTS.get(env, f"`{notes['default']}`" if "default" in notes else "")
    meaning = " ".join(re.sub(r"\.?$", ".", text, count=1) for text in (prose, *values) if text)
    return SimpleNamespace(term=term, meaning=meaning, default=default, env=env)


def tree(command):
    yield command
    for below in command.commands:
        yield from tree(below)


def table(*rows):
    head, *rows = ([text.replace("|", "\\|") for text in row] for row in rows)
    return "\n" + "".join(f"| {' | '.join(row)} |\n" for row in [head, ["---"] * len(head), *rows])


def command_line(root):
    commands = [command for command in tree(root) if command.words]
    text = f"# Command line\n\n{NOTE}\n{root.about}\n\n```\n{root.usage}\n```\n\nResults go to files. Progress and "
    text += "errors go to stderr. Exit status: 0 for success, 2 for bad usage or bad input, 1 for an internal failure.\n"
    text += table(["command", "meaning"], *([f"`{command.words}`", f"{command.about}."] for command in commands))
    text += "\n## Flags of every command\n" + flags(root)
    for command in commands:
        text += f"\n## flockreel {command.words}\n\n{command.about}.\n\n```\n{command.usage}\n```\n" + flags(command)
    return text


def flags(command):
    rows = [[f"`{item.term}`", item.default, item.meaning] for item in command.items]
    return table(["argument or flag", "default", "meaning"], *rows) if rows else ""


def settings(root, document):
    users = {}
    for command, item in ((command, item) for command in tree(root) for item in command.items if item.env):
        users.setdefault(item.env, (item, []))[1].append(f"`{command.words}`" if command.words else "all")
    rows = [[f"`{i.term}`", f"`{env}`", i.default, ", ".join(by), i.meaning] for env, (i, by) in users.items()]
    text = f"# Settings\n\n{NOTE}\nFlags override environment variables, which override the file of `--config`, "
    text += "which overrides the defaults.\nThe file is TOML. Its keys are the flags without leading dashes:\n\n"
    text += '```toml\nbind = "127.0.0.1:9000"\nmax-upload-bytes = 1000000\nno-sample = true\n```\n'
    text += table(["flag", "environment variable", "default", "commands", "meaning"], *rows)
    return text + "".join(parameters(document["components"]["schemas"], *noun) for noun in NOUNS)


def parameters(schemas, noun, command, name, request):
    """Returns the section about the parameters of a noun, whose schema has this name."""
    presets = [preset for preset in schemas[request]["properties"].get("preset", {"enum": []})["enum"] if preset]
    text = f"\n## Parameters of {noun}\n\nThe API takes them by name, and `flockreel {command} --set NAME=JSON` as well. "
    text += "`a.b` is the field `b` of the object `a`, and `[]` stands for each entry of a list.\n"
    text += f"Presets: {codes(presets)}.\n" if presets else ""
    return text + table(["parameter", "default", "values", "meaning"], *parameter_rows(schemas, schemas[name]))


def parameter_rows(schemas, schema, prefix=""):
    """Returns a row for each field of an object that is no object itself, and the rows of those that are."""
    rows = []
    for name, field in schema.get("properties", {}).items():
        inner = next((one for one in field.get("oneOf", []) if one != {"type": "null"}), field)
        whole = resolved(schemas, inner)
        items = resolved(schemas, whole.get("items", {}))
        below = [one for one in (whole, *whole.get("oneOf", []), items, *items.get("oneOf", [])) if "properties" in one]
        # The document tells no default of a free object, which is empty.
        default = "required" if name in schema.get("required", []) else f"`{json.dumps(field.get('default', {}))}`"
        prose = " ".join(inner.get("description", whole.get("description", "")).split())
        if whole.get("type") != "object" or "oneOf" in field or not below:
            rows.append([f"`{prefix}{name}`", default, values(whole, items), prose])
        for one in below:
            rows += parameter_rows(schemas, one, f"{prefix}{name}[]." if items else f"{prefix}{name}.")
    return rows


def resolved(schemas, schema):
    return schemas[schema["$ref"].rsplit("/", 1)[1]] if "$ref" in schema else schema


def values(schema, items):
    """Returns the limits or names that a schema allows, in words."""
    if names := schema.get("enum"):
        return codes(names)
    if items.get("type") in ("number", "integer") and "minItems" in schema:
        each = f", each {values(items, {})}" if "minimum" in items else ""
        return f"{schema['minItems']} numbers{each}"
    if items:
        most = f", at most {schema['maxItems']}" if "maxItems" in schema else ""
        of = "texts" if items == {"type": "string"} else values(items, {}).replace("object", "objects")
        return f"list of {of}{most}"
    if pattern := schema.get("pattern"):
        return f"`{pattern}`"
    if "exclusiveMinimum" in schema:
        return f"above {schema['exclusiveMinimum']}, at most {schema['maximum']}"
    if "maximum" in schema:
        step = f", multiple of {schema['multipleOf']}" if "multipleOf" in schema else ""
        return f"{schema['minimum']} to {schema['maximum']}{step}"
    if "minimum" in schema:
        return f"at least {schema['minimum']}"
    return "true, false" if schema.get("type") == "boolean" else "object"


def codes(names):
    return ", ".join(f"`{name}`" for name in names)


def errors(page):
    entry = r'<dt id="(\w+)">.*?<small>([^<]+)</small></dt>\s*<dd>(.*?)</dd>\s*<dd class="soft">(.*?)</dd>'
    rows = []
    for code, status, *texts in re.findall(entry, page, re.DOTALL):
        texts = [html.unescape(re.sub("</?code>", "`", text)) for text in texts]
        rows.append([f"`{code}`", status, *texts])
    if not rows or len(rows) != page.count("<dt "):
        sys.exit("reference.py: cannot read /docs/errors: its HTML has another form than the script expects")
    text = f"# Error codes\n\n{NOTE}\nThe API gives the code as `code` in `application/problem+json` (RFC 9457), and "
    text += "as `error.code` in failed jobs.\nA request for the result of a failed or cancelled job gets the code of "
    text += "the job with status 404.\nThe command line prints the code in parentheses. A code is never renamed.\n"
    return text + table(["code", "HTTP status", "meaning", "advice"], *rows)


def served(program, *paths):
    """Returns the texts at these paths of a service that runs only for this."""
    with tempfile.TemporaryDirectory() as data:
        words = [program, "serve", "--no-sample", "--bind", "127.0.0.1:0", "--data", data, "--log", "error"]
        with subprocess.Popen(words, env=ENVIRONMENT, stderr=subprocess.PIPE, text=True) as service:
            addresses = (re.search(r"http://[\d.:]+/", line) for line in service.stderr)
            address = next(filter(None, addresses), None) or sys.exit("reference.py: the service did not start")
            try:
                return [urllib.request.urlopen(f"{address[0]}{path}", timeout=30).read().decode() for path in paths]
            finally:
                service.terminate()


def main():
    parser = argparse.ArgumentParser(description="Write the reference pages from the texts of a built program.")
    parser.add_argument("program", metavar="FLOCKREEL")
    parser.add_argument("--check", action="store_true", help="write nothing; exit status 1 if a page differs")
    options = parser.parse_args()
    program = str(Path(options.program).resolve())
    root = read(program)
    codes_page, document = served(program, "docs/errors", "openapi.json")
    texts = {"command-line": command_line(root), "errors": errors(codes_page)}
    texts["settings"] = settings(root, json.loads(document))
    pages = {PAGES / f"{name}.md": text for name, text in texts.items()}
    differing = [page for page, text in pages.items() if not page.is_file() or page.read_text() != text]
    if options.check and differing:
        sys.exit("\n".join(f"out of date, run scripts/reference.py: {page.name}" for page in differing))
    for page in differing:
        page.write_text(pages[page])


if __name__ == "__main__":
    main()
