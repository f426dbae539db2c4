r"""The text of an answer file -> its answers by question, as they were typed, or what is wrong with each.

A file of lines is read line by line, so that a line that is no YAML costs its own question only. An entry
begins at a line that names a question (`3: 2.34`, `3:2.34`, `3 = 2.34`, `3. 2.34`, `3 2.34`), and goes on in
the lines that are indented deeper. What stands behind the name is read as YAML where it is that, and else as
the text that it is: `[1, 2] cm`, `- 3.2`, `|T|`.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
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
# Words with which an answer is announced.
_ANSWER = frozenset([
    "answer", "answers", "antwort", "lösung", "réponse", "respuesta", "result", "results", "solution",
    "value",
])  # fmt: skip
# A line that begins with one of the `<names>`, bare or in a bullet, a heading, bold letters or a table.
_NAMED = rf"""(?xi)
    (?P<marks>(?: [-*•+>]\s++ | [0-9]{{1,3}}[.)]\s++(?=[*_`]*+(?:<names>)[*_`]*+\s*[:=]) | \#++\s*+
        | (?P<bold>[*_`"'“„]++) | \|\s*+ )*+)
    (?P<word>(?:(?:my|the|to|for|of|zu|zur|question|problem|exercise|task|part|aufgabe|frage|teil|übung|exercice
        |ejercicio|pregunta|ans|ex|nr|no|id|q|{"|".join(sorted(_ANSWER))}) [.:_-]?\s*+)*?)
    (?P<open>\()? (?P<name><names>) (?(open)\)) ["'”“]*+ (?P<dash>\s+[-–—](?=\s+\S|\Z))?
    \s*[*_`]*+ (?P<end>\t|\s*(?:[:=]=?>?|->|→|[.)|](?=[\s*_`]|\Z)))? (?(bold)[*_`]*+) (?(end)|(?=\s|\Z))
    \s* (?P<rest>.*)"""
_BULLET = re.compile(r"(?:[-*•+]|[0-9]+[.)])\s")  # of a list, which may be numbered
_BEGINNING = re.compile(r"[-+~]?[0-9.\[({\\$]")  # of a number, a list or a formula
# The beginning of a sentence: two words in a row, of the first four.
_SENTENCE = re.compile(r"(?:\w+ ){0,2}[^\W\d_]{2,} [^\W\d_]{2,}")
_RULE = re.compile(r"\s*(?:[-=|:+]\s*){3,}")  # of a table, or below a heading
_LABEL = re.compile(rf"(?i)\s*[*_]*(?:{'|'.join(sorted(_ANSWER))})[*_]*:[*_]*(?:\s+|$)")
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
    text = text.removeprefix("\ufeff").replace("：", ": ")
    text = re.sub(r"(?im)^([^\S\n]*answers[^\S\n]*)=", r"\1:", text)
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
    entries, stray = _entries(lines[begin + 1 :], begin + 2, names)
    heads = {folded(entry.name) for entry in entries}
    if refused and (heads.isdisjoint(names) if names else section is None):
        raise refused
    is_other = not heads or (names and heads.isdisjoint(names) and heads.isdisjoint(ABOUT))
    if section is None and text.strip() and is_other:
        raise Unreadable("wrong_shape", "expected `answers`, a mapping from questions to answers")
    given = ((entry.name, f"line {entry.number}: ", entry.value()) for entry in entries)
    return _by_question(given, known), capped(stray)


def _spelled(name: str, names: Collection[str]) -> str:
    """The name of a question, which is `1a` also where `1 (a)` or `1.a` is written."""
    return name if folded(name) in names else re.sub(r"[\s.]*\(?([^\W\d]+)\)?$", r"\1", name)


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
    """One answer: its `name`, its lines, the `number` of the first one in the file, and its indentation.

    Names in the same `dress` are siblings: the signs around a name. All lines below an `is_open` one are its
    own. The words of a heading are a `title`, unless there is no other answer below.
    """

    name: str
    lines: list[str]
    dress: str = ""
    is_open: bool = False
    title: str = ""
    number: int = 0
    indent: int = 0
    depth: int = -1  # the indentation of what stands below the name, if anything does
    brackets: int = 0  # those that are open
    braces: int = 0

    def __post_init__(self) -> None:
        first, self.lines = self.lines[0], []
        self.add(first)

    def add(self, line: str) -> None:
        if self.lines and line.strip() and self.depth < 0:
            self.depth = len(line) - len(line.lstrip())
        self.lines.append(line)
        self.brackets += sum(map(line.count, "([")) - sum(map(line.count, ")]"))
        self.braces += line.count("{") - line.count("}")

    @property
    def is_empty(self) -> bool:
        """Whether nothing stands behind the name as yet."""
        return self.depth < 0 and not self.lines[0].strip()

    def value(self) -> Tree | Unreadable:
        """The answer, as YAML or else as text."""
        below = next((line.strip() for line in self.lines if line.strip()), "")
        if self.title and (not below or _SENTENCE.match(below)):
            self.lines = [self.title]
        labels = [place for place, line in enumerate(self.lines) if _LABEL.match(line)]
        if labels:  # what stands above is the question
            self.lines = [_LABEL.sub("", self.lines[labels[0]]), *self.lines[labels[0] + 1 :]]
        texts = [text for line in self.lines if (text := re.sub(r"(^|\s)#.*", "", line).strip())]
        try:
            tree = tree_of("x: " + "\n ".join(self.lines) + "\n")["x"]
        except Unreadable as unreadable:
            finding = unreadable.findings[0]
            if finding.code != "parse_error":
                return Unreadable(finding.code, f"line {self.number}: {finding.detail.partition(': ')[2]}")
            is_list = texts and not self.lines[0].strip() and all(text.startswith("- ") for text in texts)
            return [text[2:].strip() for text in texts] if is_list else "\n".join(texts)
        if isinstance(tree, dict) and len(tree) == 1 and _ANSWER.issuperset(map(str.lower, tree)):
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
    heads = list(_heads(lines, names))
    is_aside = is_apart = False
    for number, (raw, named) in enumerate(zip(lines, heads, strict=True), first):
        line = raw.expandtabs(8) if raw[:1] == "\t" else raw.rstrip()
        text = line.lstrip(" ")
        indent = len(line) - len(text)
        last = entries[-1] if entries else None
        is_below = last is not None and not last.lines[0].strip() and not last.indent >= indent < last.depth
        head = named if named and _is_name(named, last, text, indent, is_below=is_below) else None
        is_silent = head is None and (_SILENT.match(text) is not None or _is_ruled(text, last))
        is_question = head is not None
        head = head or (None if is_silent else _key(text, is_numbered=not names, is_below=is_below))
        # What begins as a sentence is no answer, up to the end of its paragraph.
        is_word = len(text) > 1 and text.rstrip(".,!:").isalpha()
        is_said = is_word or ("=" not in text and _SENTENCE.match(text) is not None)
        is_begun = last is not None and not last.is_empty and not last.lines[0].startswith(("|", ">"))
        is_aside = bool(text) and (is_aside or (is_said and is_apart and is_begun))
        if last is not None:
            # A key begins the next answer, unless a brace is open.
            is_inside = last.brackets + last.braces > 0 and not (_KEY.match(text) and last.braces <= 0)
            # A question stands by itself, however deep.
            is_deeper = (indent > last.indent or last.is_open) and not is_question
            # An equation goes on with another one, and a formula behind an operator.
            is_formula = ("=" in text and "=" in last.lines[0]) or last.lines[-1].endswith(tuple("+-*/="))
            is_more = is_below or (is_formula and not is_apart)
            is_lead = head is None and (last.is_empty or _GOES_ON.match(text) or (is_more and not is_said))
            is_label = head and folded(head.name) in _ANSWER.difference(names)
            if is_silent or is_inside or is_label or (not is_aside and (is_deeper or is_lead)):
                is_empty = _is_ruled(text, last) or text.rstrip() in ("---", "...")
                last.add("" if is_empty else line)
                is_apart = not text
                continue
        is_aside, is_apart = head is None, not text
        if head is not None:
            head.number, head.indent = number, indent if last is None else min(indent, last.indent)
            entries.append(head)
            if len(entries) > MOST_ANSWERS:
                raise Unreadable("too_large", f"expected at most {MOST_ANSWERS:,} answers")
        elif not is_silent:
            stray.append(f"line {number} is no answer: {shown(line.strip())}")
    return entries, stray


def _heads(lines: Sequence[str], names: Sequence[str]) -> Iterator[_Entry | None]:
    """For each line the entry that it begins if it is no part of another: by the name of a question.

    A dash behind a bare name may be a minus sign: it separates if all bare names have one.
    """
    parts = [re.sub(r"([0-9])([a-z]+)$", r"\1[\\s.]*(?:\2|\\(\2\\))", re.escape(name)) for name in names]
    pattern = re.compile(_NAMED.replace("<names>", "|".join(parts) or r"\b\B"))
    found = [pattern.fullmatch(line.strip()) for line in lines]
    bare = [match for match in found if match and not any(match.group("marks", "word", "open"))]
    are_dashed = len(bare) > 1 and all(match["dash"] for match in bare)
    titles = sum(match["marks"].strip() == "#" for match in found if match)
    is_title = titles == 1 and any("|" not in (match["end"] or "|") for match in found if match)
    for match in found:
        if match is None or (match["marks"].strip() == "#" and (match["rest"] or is_title)):
            yield None
            continue
        marks, end = match["marks"], (match["end"] or "").strip(" ")
        is_bare, rest = not any(match.group("marks", "word", "open")), match["rest"].strip()
        if match["dash"] and is_bare and not are_dashed:
            rest = match.string[match.start("dash") :].strip()
        end = end or (match["open"] or "") or "-" * bool(match["dash"] and (not is_bare or are_dashed))
        is_told = end or _is_plain(match["name"], rest)
        if match["word"] and not end:
            is_told = not (match["word"].endswith(" ") and _SENTENCE.match(rest))
        if not (is_told or marks.endswith(("*", "_", "`")) or (marks and not _BULLET.match(marks))):
            yield None
            continue
        dress = re.sub(r"[\w\s]", "", marks) + "?" * bool(match["word"]) + end
        rest = rest.removesuffix("|").strip() if "|" in dress else rest
        is_said = ("#" in marks or rest.endswith("**")) and "=" not in rest and _SENTENCE.match(rest)
        title, rest = (rest.strip("* "), "") if is_said else ("", rest)
        is_open = not rest and (not is_bare or end in (".", ")")) and not _BULLET.match(marks)
        yield _Entry(_spelled(match["name"], names), [rest], dress, is_open, title)


def _is_name(entry: _Entry, last: _Entry | None, text: str, indent: int, *, is_below: bool) -> bool:
    """Whether a line with the name of a question begins its answer, and is no part of the `last` one.

    What stands below a name may be a mapping, a list or a table, unless the name above is dressed alike.
    """
    if last is None or (entry.dress and entry.dress == last.dress and indent <= last.indent):
        return True
    is_loose = (
        entry.dress in ("", ".", ")", "(", "-", "=", "\t") or indent > last.indent or _BULLET.match(text)
    )
    return not (is_below and is_loose) and "|" not in entry.dress


def _is_ruled(text: str, last: _Entry | None) -> bool:
    """Whether a line is a rule below a heading, or a row of a table with other things than answers."""
    if last is None or "|" in last.dress:
        return text.startswith("|") or (last is not None and _RULE.fullmatch(text) is not None)
    return last.is_empty and "|" not in text and _RULE.fullmatch(text) is not None


def _key(text: str, *, is_numbered: bool, is_below: bool) -> _Entry | None:
    """The entry of a line with a name that is no question's; `is_below`: a name alone stands above."""
    name, colon, behind = text[:100].partition(":")
    name = "" if is_below and _BULLET.match(text) else name.strip().strip("\"'")
    if colon and name and (not behind.strip() or behind[:1] == " " or _PLAIN.fullmatch(name)):
        return _Entry(name, [text.partition(":")[2].strip()], ":")
    numbered = _NUMBERED.fullmatch(text) if is_numbered and not is_below else None
    return _Entry(numbered["name"], [numbered["value"]]) if numbered else None


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
