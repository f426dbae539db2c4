r"""The text of an answer file -> its answers by question, as they were typed, or what is wrong with each.

A file of lines is read line by line, so that a line that is no YAML costs its own question only. An entry
begins at a line that names a question (`3: 2.34`, `3:2.34`, `3 = 2.34`, `3. 2.34`, `3 2.34`), and goes on in
the lines that are indented deeper. What stands behind the name is read as YAML where it is that, and else as
the text that it is: `[1, 2] cm`, `- 3.2`, `|T|`.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from rigidcli.document.yaml_reader import read_tree
from rigidcli.errors import DocumentError, shown
from rigidcli.homework.base import Tree, Unreadable

# Answers by the names of questions; one that cannot be read is what is wrong with it.
Answers: TypeAlias = dict[str, Tree | Unreadable]
MOST_ANSWERS = 1000  # in a file
# Keys beside the answers that say who the student is, which nobody believes.
ABOUT = frozenset(["student", "name"])
# The line with which the answers begin; they may stand on it.
_SECTION = re.compile(r"""["']?answers["']?\s*(?:$|#|:\s*(?P<value>[^\s#].*)?)""", re.IGNORECASE)
# A line that says nothing: empty, a comment, or a mark of YAML.
_SILENT = re.compile(r"#|%YAML|---\s*$|\.\.\.\s*$|$")
# The beginning of a line that continues the one before, however it is indented.
_GOES_ON = re.compile(r"[-+*/=&|)\]},;.<>^\\]")
# A name that is no part of a formula or an address, even if no blank stands behind its colon.
_PLAIN = re.compile(r"[\w.()-]{1,20}")
# A key that begins the next answer, also where a bracket before it was never closed.
_KEY = re.compile(r"[\w.()'\"-]{1,100}:\s")
# A number that may be the name of a question, with `=`, a dot, or a blank behind it.
_NUMBERED = re.compile(r"(?P<name>[0-9][\w.]{0,20}?)(?:\s*=\s*|[.)]\s+|\s+)(?P<value>\S.*)")
# A line that begins with the name of a question in a bullet, a list, a heading, bold letters or a table.
_DRESSED = re.compile(
    r"""(?xi) (?P<indent>\s*+)
    (?P<marks>(?: [-*•+]\s++ | [0-9]{1,3}[.)]\s++(?=[\w.-]+\s*[:=]) | \#++\s*+ | \*\* | __ | \|\s*+ )*+)
    (?P<word>(?:question|problem|exercise|task|aufgabe|frage|übung|exercice|ejercicio|pregunta|answer
        |antwort|ex|nr|no|id|q)
        [.:]?\s*+)?
    (?P<open>\()? (?P<name>[\w.-]*\w) (?(open)\)) (?P<dash>\s+[-–—](?=\s+\S|\Z))?
    \s*(?:\*\*|__)?\s* (?P<end>[:=.)|])? \s*(?:\*\*|__)? (?=\s|\Z) \s* (?P<rest>.*)"""
)
_BULLET = re.compile(r"(?:[-*•+]|[0-9]+[.)])\s")  # of a list, which may be numbered
_BEGINNING = re.compile(r"[-+~]?[0-9.\[({\\$]")  # of a number, a list or a formula
# The heads of a table of csv that has a question and its answer in each line.
_HEADS = re.compile(
    r"(?i)\s*[\"']?(?:question|problem|exercise|task|aufgabe|frage|pregunta|id|nr)[\"']?\s*([,;\t])"
    r"\s*[\"']?(?:answer|antwort|réponse|respuesta|result|value)s?[\"']?[ \t]*(?=\r?\n)"
)
# The most blanks between words, as patterns look at each of them many times; more say nothing.
LONGEST_GAP = 20
_LONG_GAP = re.compile(rf"(?<=\S)[^\S\n]{{{LONGEST_GAP},}}")
_QUOTED = re.compile(r'"(?:[^"\\\n]|\\.)*"')
# Commands of LaTeX: some begin like an escape of YAML, such as `\t`, and all others do not.
_LATEX = re.compile(
    r"[^0abtnvfreNLPxuU\W\d_].*|alpha|approx|begin|beta|bar|big[lr]?|end|epsilon|ell|eta|exp|frac|nabla|nu|rho|"
    r"right|rm|tan|tau|text|tfrac|theta|times|varphi|vartheta|vec"
)


def folded(id: str) -> str:
    """The name of a question or a student, in whatever capitals, blanks and form of Unicode."""
    return " ".join(unicodedata.normalize("NFC", id).casefold().split())


def tree_of(text: str) -> Tree:
    """What a text is in YAML. Raises Unreadable."""
    try:
        return read_tree(text, "", is_text=lambda path: True)
    except DocumentError as error:
        problem = error.problems[0]
    place = "" if problem.line is None else f"line {problem.line}: "
    message = ": ".join(filter(None, [place + problem.message, problem.hint]))
    raise Unreadable("too_large" if problem.code == "too_deep" else problem.code or "parse_error", message)


def read_answers(text: str, known: Collection[str] = ()) -> tuple[Answers, list[str]]:
    """The answers in a text by the names of questions, and notes on lines that are none.

    Names that are not `known` are as they are spelled. Raises Unreadable where there are no answers.
    """
    if re.search(r"[\x00-\x08\x0b\x0e-\x1f\x7f]", text):  # form feeds may stand in a text
        raise Unreadable("parse_error", "there are control characters in it: is it a text file?")
    names = sorted({folded(name) for name in known}, key=len, reverse=True)
    text = _LONG_GAP.sub(" " * LONGEST_GAP, text)
    text = re.sub(r"(?im)^([^\S\n]*answers[^\S\n]*)=", r"\1:", text.removeprefix("\ufeff"))
    if table := _HEADS.match(text):
        text = "answers:" + re.sub(rf"(?m)^([^{table[1]}\n]*){table[1]}", r"\1: ", text[table.end() :])
    lines = _QUOTED.sub(_literal, text).splitlines()
    sections = ((place, _SECTION.match(line.strip())) for place, line in enumerate(lines))
    begin, section = next(((place, match) for place, match in sections if match), (-1, None))
    is_flow = text.lstrip().startswith("{")
    refused: Unreadable | None = None
    if is_flow or (section and section["value"]):
        try:
            tree = _of_tree(tree_of("\n".join(lines if is_flow else lines[begin:])), names)
            return _by_question(((name, "", answer) for name, answer in tree.items()), known), []
        except Unreadable as unreadable:
            if unreadable.findings[0].code in ("wrong_shape", "too_large", "not_allowed"):
                raise
            # Brackets and commas are taken away, and what is left is read line by line.
            refused = unreadable
            lines = [re.sub(r"[,{]\s*$|^\s*[{}][{}\s,]*", "", line) for line in lines]
    readings = [_entries(form, begin + 2, names) for form in _forms(lines[begin + 1 :], names)]
    entries, stray = max(readings, key=lambda reading: _answered(reading[0], reading[1], names))
    heads = {folded(entry.name) for entry in entries}
    if refused and (heads.isdisjoint(names) if names else section is None):
        raise refused
    is_other = not heads or (names and heads.isdisjoint(names) and heads.isdisjoint(ABOUT))
    if section is None and text.strip() and is_other:
        raise Unreadable("wrong_shape", "expected `answers`, a mapping from questions to answers")
    given = ((entry.name, f"line {entry.number}: ", entry.value()) for entry in entries)
    return _by_question(given, known), capped(stray)


def _forms(lines: list[str], names: Collection[str]) -> list[list[str]]:
    """The lines as they are, and with `name: answer` in place of bullets, headings, bold letters and tables.

    What stands below a heading is its answer. A dash behind a name may be a minus sign: it counts if all
    names without other marks have one. The likelier form comes first: bullets may be the list that is an
    answer.
    """
    found: dict[int, re.Match[str]] = {}
    for place, line in enumerate(lines):
        match = _DRESSED.fullmatch(line.rstrip())
        if match is None or folded(match["name"]) not in names:
            continue
        is_comment = match["marks"].strip() == "#" and match["rest"]
        is_told = match["end"] or match["dash"] or match["word"] or _is_plain(match["name"], match["rest"])
        if not is_comment and (is_told or not _BULLET.match(match["marks"])):
            found[place] = match
    bare = {place: match for place, match in found.items() if not any(match.group("marks", "word", "open"))}
    is_dashed = len(bare) > 1 and all(match["dash"] for match in bare.values())
    is_table = any("|" in match["marks"] for match in found.values())
    undressed, margin = list[str](), ""
    for place, line in enumerate(lines):
        match = found.get(place)
        if match and (is_dashed or place not in bare):
            rest = match["rest"].removesuffix("|").strip() if "|" in match["marks"] else match["rest"]
            undressed.append(f"{match['indent']}{match['name']}: {rest}")
            margin = "" if _BULLET.match(match["marks"]) else "  "
        elif not (is_table and line.lstrip().startswith("|")):
            undressed.append(margin + line)
    if undressed == lines:
        return [lines]
    has_bullets = any(_BULLET.match(match["marks"]) for match in found.values())
    return [lines, undressed] if has_bullets else [undressed, lines]


def _answered(entries: Sequence[_Entry], stray: Sequence[str], names: Collection[str]) -> int:
    """How many questions have an answer; none where other lines stand beside few of them, as in prose."""
    given = {folded(entry.name) for entry in entries if not entry.is_begun}
    number = sum(name in given for name in names)
    return 0 if stray and 2 * number < len(names) else number


def _literal(quoted: re.Match[str]) -> str:
    """A quoted text in which backslashes of LaTeX are doubled, so that YAML keeps them."""
    if not any(_LATEX.fullmatch(escape) for escape in re.findall(r"\\([a-zA-Z]+|.)", quoted[0])):
        return quoted[0]
    return re.sub(r"\\(.)", lambda pair: pair[0] if pair[1] in '\\"' else f"\\{pair[0]}", quoted[0])


def _of_tree(tree: Tree, names: Collection[str]) -> dict[str, Tree]:
    """The answers of a file that is YAML as a whole, as they are spelled. Raises Unreadable."""
    if isinstance(tree, dict):
        keys = {folded(key): key for key in tree}
        if "answers" in keys:
            answers = tree[keys["answers"]]
            if isinstance(answers, dict | None):
                return answers or {}
        elif not names or not keys.keys().isdisjoint(names) or keys.keys() <= ABOUT:
            return tree
    raise Unreadable("wrong_shape", "expected `answers`, a mapping from questions to answers")


@dataclass(slots=True)
class _Entry:
    """One answer: its `name`, its lines, the `number` of the first one in the file, and its indentation."""

    name: str
    number: int
    indent: int
    lines: list[str]
    brackets: int = 0  # those that are open
    braces: int = 0

    def add(self, line: str) -> None:
        self.lines.append(line)
        self.brackets += sum(map(line.count, "([")) - sum(map(line.count, ")]"))
        self.braces += line.count("{") - line.count("}")

    @property
    def is_begun(self) -> bool:
        """Whether nothing stands behind the name as yet."""
        return not any(line.strip() for line in self.lines)

    def value(self) -> Tree | Unreadable:
        """The answer, as YAML or else as text."""
        texts = [text for line in self.lines if (text := re.sub(r"(^|\s)#.*", "", line).strip())]
        try:
            tree = tree_of("x: " + "\n ".join(self.lines) + "\n")["x"]
        except Unreadable as unreadable:
            finding = unreadable.findings[0]
            if finding.code != "parse_error":
                return Unreadable(finding.code, f"line {self.number}: {finding.detail.partition(': ')[2]}")
            is_list = texts and not self.lines[0].strip() and all(text.startswith("- ") for text in texts)
            return [text[2:].strip() for text in texts] if is_list else "\n".join(texts)
        if isinstance(tree, dict) and list(map(str.lower, tree)) == ["answer"]:
            return next(iter(tree.values()))
        is_text = isinstance(tree, str) and texts and not texts[0].startswith(("'", '"', "|", ">"))
        # YAML would join the lines of a text, each of which may be an equation; and where semicolons separate
        # numbers, it would cut these at their decimal commas.
        is_cut = texts and texts[0].startswith(("[", "{")) and ";" in _QUOTED.sub("", "\n".join(texts))
        return "\n".join(texts) if is_text or is_cut else tree


def _entries(lines: list[str], first: int, names: Sequence[str]) -> tuple[list[_Entry], list[str]]:
    """The entries in lines, and notes on lines that are in none. Lines are counted from `first`.

    `names` are those of the questions, the longest first. Raises Unreadable for too many.
    """
    entries, stray = list[_Entry](), list[str]()
    for number, raw in enumerate(lines, first):
        line = raw.expandtabs(8) if raw[:1] == "\t" else raw.rstrip()
        text = line.lstrip(" ")
        indent = len(line) - len(text)
        last = entries[-1] if entries else None
        is_silent = _SILENT.match(text) is not None
        is_below = last is not None and not last.lines[0].strip()
        head = None if is_silent else _head(text, names, is_below=is_below)
        if last is not None:
            # A key begins the next answer, unless a brace is open.
            is_inside = last.brackets + last.braces > 0 and not (_KEY.match(text) and last.braces <= 0)
            # A question stands by itself, however deep.
            is_question = head and not is_below and folded(head[0]) in names
            is_lead = head is None and (last.is_begun or _GOES_ON.match(text))
            if is_silent or is_inside or (indent > last.indent and not is_question) or is_lead:
                last.add(line)
                continue
        if head is not None:
            depth = indent if last is None else min(indent, last.indent)
            entries.append(_Entry(head[0], number, depth, []))
            entries[-1].add(head[1])
            if len(entries) > MOST_ANSWERS:
                raise Unreadable("too_large", f"expected at most {MOST_ANSWERS:,} answers")
        elif not is_silent:
            stray.append(f"line {number} is no answer: {shown(line.strip())}")
    return entries, stray


def _head(text: str, names: Sequence[str], *, is_below: bool) -> tuple[str, str] | None:
    """The name at the beginning of a line, and what is behind it; `is_below`: a name alone stands above."""
    plain = text.lstrip("\"'")
    for name in names:
        if plain[: len(name)].casefold() == name:
            behind = plain[len(name) :].lstrip("\"'")
            mark = re.match(r"\s*[:=]\s*|[.)]\s+|\s+(?=\S)", behind)
            if mark and (mark[0].strip() or _is_plain(name, behind[mark.end() :])):
                return plain[: len(name)], behind[mark.end() :]
    name, colon, behind = text[:100].partition(":")
    name = "" if is_below and _BULLET.match(text) else name.strip().strip("\"'")
    if colon and name and (not behind.strip() or behind[:1] == " " or _PLAIN.fullmatch(name)):
        return name, text.partition(":")[2].strip()
    numbered = None if names or is_below else _NUMBERED.fullmatch(text)
    return (numbered["name"], numbered["value"]) if numbered else None


def _is_plain(name: str, answer: str) -> bool:
    """Whether a name and an answer with a blank between them are no sentence: `3 oblate`, `rate 2.34`."""
    return bool(answer and re.search("[0-9]", name)) or _BEGINNING.match(answer) is not None


def _by_question(given: Iterable[tuple[str, str, Tree | Unreadable]], known: Collection[str]) -> Answers:
    """The answers by the names of the questions, in whatever capitals; one that stands twice is none.

    What is `given` is a name as it is spelled, its place in the file, and the answer.
    """
    spelled, answers = {folded(id): id for id in known}, Answers()
    for name, place, answer in given:
        id = name if name in known else spelled.setdefault(folded(name), name)
        if id in answers:
            answers[id] = Unreadable("duplicate_key", f"{place}the key {shown(name)} stands twice")
        elif id in known or folded(name) not in ABOUT:
            answers[id] = answer
    return answers


def capped(names: Sequence[str], note: Callable[[str], str] = str) -> list[str]:
    """A note on each of the first names, and how many more there are."""
    first, more = names[:5], len(names) - 5
    return [*map(note, first), *([f"and {more:,} more of this kind"] if more > 0 else [])]


def as_typed(answer: Tree | Unreadable) -> str:
    """An answer as it was typed, in one line where it is a list or a mapping."""
    if isinstance(answer, Mapping):
        return f"{{{', '.join(f'{key}: {as_typed(value)}' for key, value in answer.items())}}}"
    if isinstance(answer, list):
        return f"[{', '.join(map(as_typed, answer))}]"
    return "" if answer is None or isinstance(answer, Unreadable) else "; ".join(str(answer).splitlines())
