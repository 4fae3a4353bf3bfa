#!/usr/bin/env python3
"""Writes docs/api.md from the docstrings of the installed package; a test compares them.

  docs/make_api.py > docs/api.md        needs `pip install .` and Mitsuba 3
"""
import inspect
import re
import textwrap

import mitsuba

mitsuba.set_variant("scalar_rgb")
import warpath
import warpath.mitsuba

CHAPTERS = {
    "Integrals": [warpath.Integrator, warpath.Result, warpath.Sample],
    "Training with any renderer": [warpath.Layout, warpath.Group, warpath.Candidates, warpath.train, warpath.Warp],
    "The embedded renderer": [warpath.load_scene, warpath.render, warpath.Scene, warpath.Image],
    "Mitsuba 3": [warpath.mitsuba.render, warpath.mitsuba.train, warpath.mitsuba.register],
}


#: Of lines of prose and of code.
WIDTH, CODE_WIDTH = 119, 100


def wrapped(lines):
    """Paragraphs and items of lists, broken anew; code as it is."""
    out, open_lines, code = [], [], False

    def close():
        text = " ".join(line.strip() for line in open_lines)
        indent = "  " if text.startswith("- ") else ""
        out.extend(textwrap.wrap(text, WIDTH, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False))
        open_lines.clear()

    for line in lines:
        fence = line.startswith("```")
        if code or fence or not line or line.startswith("- "):
            close()
        code ^= fence
        if code or fence or not line:
            out.append(line)
        else:
            open_lines.append(line)
    close()
    return re.sub(r"\n{3,}", "\n\n", "\n".join(out)).strip()


def prose(doc):
    """A docstring as Markdown: sections as lists, examples as code."""
    lines, code, section = [], False, False
    for line in doc.splitlines():
        if code and not line.strip():
            lines.append("```")
            code = False
        if not code and line.strip().startswith(">>> "):
            lines += ["```python"]
            code = True
        heading = re.fullmatch(r"(Args|Returns|Raises|Attributes|Example):(.*)", line)
        if heading and not code:
            section = True
            lines += ["", f"**{heading[1]}.**{heading[2]}", ""]
        elif code:
            lines.append(re.sub(r"\s+# doctest: \+SKIP", "", line.strip()))
        elif section and re.match(r"    \S", line):
            named = re.match(r"    ([\w, ]+): (.*)", line)
            lines.append(f"- `{named[1]}`: {named[2]}" if named else line.strip())
        else:
            lines.append(line.strip())
    return wrapped(lines + ["```"] * code)


def signature(name, thing):
    try:
        text = str(inspect.signature(thing))
    except ValueError:
        return name
    # Annotations are strings in the source, and defaults may be.
    text = re.sub(r"(: |-> )'([^']*)'", r"\1\2", text)
    return name + re.sub(r"\((self|cls)(, )?", "(", text)


def declaration(name, thing):
    """A signature as code: on one line, or a line for each parameter."""
    text = signature(name, thing)
    if len(text) > CODE_WIDTH:
        parameters = re.split(r", (?![^\[(]*[\])])", text[text.index("(") + 1 : text.rindex(")")])
        text = "\n".join([text[: text.index("(") + 1], *(f"    {parameter}," for parameter in parameters), text[text.rindex(")") :]])
    return f"```\n{text}\n```"


def public_members(kind):
    for name, member in vars(kind).items():
        if (not name.startswith("_") or name == "__call__") and inspect.getdoc(member) and not inspect.isbuiltin(member):
            yield name, member


def entry(thing):
    name = f"{thing.__module__.split('.')[0]}{'.mitsuba' if '.mitsuba' in thing.__module__ else ''}.{thing.__name__}"
    tuples = inspect.isclass(thing) and issubclass(thing, tuple)
    bare = tuples or thing in (warpath.Scene, warpath.Image, warpath.Result, warpath.Warp)  # made by other functions
    yield f"### `{name}`\n"
    if not bare:
        yield declaration(name, thing) + "\n"
    yield prose(inspect.getdoc(thing)) + "\n"
    if tuples:
        yield "Fields: " + ", ".join(f"`{field}`" for field in thing._fields) + ".\n"
    elif inspect.isclass(thing):
        yield from members(thing)


def members(kind):
    """Properties as a list, then functions as they are called."""
    found = list(public_members(kind))
    properties = [wrapped([f"- `{name}`: {inspect.getdoc(value)}"]) for name, value in found if isinstance(value, property)]
    if properties:
        yield "\n".join(properties) + "\n"
    for name, value in found:
        if not isinstance(value, property):
            shown = "integrator" if name == "__call__" else name
            function = value.__func__ if isinstance(value, (classmethod, staticmethod)) else value
            yield f"#### `{kind.__name__}.{shown}`\n" if name != "__call__" else "#### A call\n"
            yield f"{declaration(shown, function)}\n\n{prose(inspect.getdoc(value))}\n"


def main():
    print("# API of the Python package\n\nWritten by `docs/make_api.py` from the docstrings. [Tutorial](../examples/python/tutorial.py) ·\n"
          "[Integrate any function](integrate.md) · [User guide](guide.md)\n")
    for title, things in CHAPTERS.items():
        print(f"## {title}\n")
        for thing in things:
            print("\n".join(entry(thing)))


if __name__ == "__main__":
    main()
