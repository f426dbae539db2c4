"""Single answers: numbers and quantities with their units and figures, words and sets of words."""

from __future__ import annotations

import math
import re
import unicodedata
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import get_args

import numpy as np

from rigidcli.core.principal import BodyClass
from rigidcli.errors import ValueProblem, shown
from rigidcli.fields.dimensions import ANGLE, DIMENSIONLESS
from rigidcli.fields.units import Unit, parse_unit
from rigidcli.homework import numbers
from rigidcli.homework.base import AnswerKind, Finding, KeySource, Outcome, ReadAnswer, Tree, Unreadable
from rigidcli.homework.doubts import doubt_of_name
from rigidcli.homework.entries import NOISE_OF_ENTRIES, Ruler, Same, beside, chosen, value_of
from rigidcli.homework.mistakes import TURN, common_factor
from rigidcli.homework.numbers import PURE, TypedNumber, in_dimension
from rigidcli.language.latex import plain as without_latex
from rigidcli.language.tokens import rewritten, rules
from rigidcli.language.typed import undecorated
from rigidcli.language.words import table


@dataclass(frozen=True, slots=True, eq=False)
class NumberKey:
    """The right number in SI units, and the unit of an answer without one. A literal key has no `path`."""

    reference: float
    unit: Unit
    ruler: Ruler
    needs_unit: bool
    path: tuple[str, ...]

    def is_near(self, value: float, scale: float) -> bool:
        """Whether an SI value is within the tolerance, where one of the typed unit is `scale`."""
        return self.ruler.is_near(value, self.reference, scale)


class QuantityKind(AnswerKind):
    """A number, with a unit where it is a `quantity`."""

    options = frozenset({"products", "unit"})

    def __init__(self, name: str) -> None:
        self.name = name  # type: ignore[misc]  # two kinds of the same class

    def key(self, source: KeySource) -> NumberKey:
        question = source.question
        if source.report is not None:
            value, unit = value_of(source.value), parse_unit(source.unit) if source.unit else PURE
        else:
            number = numbers.readings_of(source.value)[0]
            value, unit = number.typed, number.unit or PURE
            if (question.kind == "quantity") is not bool(unit.text):
                has_unit, kind = ("has one", "quantity") if unit.text else ("has none", "number")
                message = f"a quantity has a unit, a number has no unit, and this {has_unit}"
                raise ValueProblem(message, hint=f"make it of kind `{kind}`")
        path = source.path
        is_product = len(path) > 2 and path[-3].startswith("tensor") and path[-2] != path[-1]
        reference = value * unit.scale * (-1 if question.products == "plus" and is_product else 1)
        if not math.isfinite(reference) or (value and not reference):
            raise ValueProblem("the number is beyond the range of SI units")
        is_angle = source.report is not None and unit.dimension == ANGLE
        noise = NOISE_OF_ENTRIES * max(beside(source) * unit.scale, is_angle)
        reference = 0.0 if abs(reference) <= noise else reference
        ruler = Ruler(question.tolerance, unit, noise=noise)
        needs_unit = question.unit == "required" and unit.dimension not in (DIMENSIONLESS, ANGLE)
        return NumberKey(reference, unit, ruler, needs_unit, path)

    def read(self, key: NumberKey, answer: Tree) -> ReadAnswer:
        """A number in its own unit, or else in that of the key. Raises Unreadable."""
        several = numbers.readings_of(answer, key.unit)
        if key.ruler.tolerance.significant_figures is not None:
            several = [number for number in several if number.mantissa]
            if not several:
                raise Unreadable("not_a_number", "significant figures are asked for: write a decimal number")
        number = chosen(several, lambda each: self._is_right(key, each))
        bare = number.unit is None and key.unit.text and not key.needs_unit
        read_as = f"{number.read_as} {key.unit.text}" if bare else number.read_as
        doubt = numbers.taken_back(number.remark)
        with suppress(ValueProblem):
            doubt = doubt or key.ruler.doubt(answer, in_dimension(number, key.unit))
            doubt = doubt or doubt_of_name(str(answer), key.unit)
        return ReadAnswer(number, read_as, doubt)

    def _is_right(self, key: NumberKey, number: TypedNumber) -> Same:
        with suppress(ValueProblem):
            number = in_dimension(number, key.unit)
            return key.is_near(number.value, number.scale) or "its unit fits, which is better than none"
        return False

    def judge(self, key: NumberKey, value: TypedNumber) -> Outcome:
        try:
            number = in_dimension(value, key.unit)
        except ValueProblem as problem:
            if key.unit is PURE and key.path[:1] == ("hamilton",) and key.is_near(value.value, value.scale):
                return Outcome.review("the unit of this result is not known")
            return Outcome.earning(0.0, _of_misfit(key, value, numbers.with_hint(problem)))
        is_right = key.is_near(number.value, number.scale)
        if is_right and key.ruler.too_few(number):
            return Outcome.earning(0.0, Finding("too_few_sig_figs"))
        unitless = [Finding("unit_missing")] if key.needs_unit and value.unit is None else []
        if is_right:
            return Outcome.earning(0.0, *unitless) if value.typed and unitless else Outcome.correct()
        return Outcome.earning(0.0, *unitless, Finding(self._slip(key, number)))

    def _slip(self, key: NumberKey, number: TypedNumber) -> str:
        """The code of the mistake that leads from the key to this number."""
        if key.ruler.is_short(number, key.reference):
            return "too_few_sig_figs"
        if number.unit is not None and key.is_near(number.typed * key.unit.scale, key.unit.scale):
            return "wrong_unit_right_number"
        slack = key.ruler.margin(key.reference, number.scale) / abs(key.reference or 1)
        if not key.reference or slack >= 1:
            return "outside_tolerance"
        code = common_factor(number.value / key.reference, key.unit, key.path, max(slack, NOISE_OF_ENTRIES))
        # Of a single number a factor says which twenty numbers the key may be.
        return "outside_tolerance" if code in (None, "constant_factor") else code

    def typed(self, key: NumberKey) -> Tree:
        """The key with all its digits, in its unit."""
        return f"{key.reference / key.unit.scale!r} {key.unit.text}".strip()


def _of_misfit(key: NumberKey, number: TypedNumber, detail: str) -> Finding:
    """What is wrong with a unit of another dimension: hertz is not radians per second."""
    given, asked = number.unit.dimension if number.unit else DIMENSIONLESS, key.unit.dimension
    if given.cycle != asked.cycle and given._replace(angle=0, cycle=0) == asked._replace(angle=0, cycle=0):
        if key.is_near(number.typed * number.scale, number.scale):
            return Finding("wrong_unit_right_number")
        if key.is_near(number.typed * number.scale * (TURN if given.cycle else 1 / TURN), number.scale):
            return Finding("frequency_vs_angular_frequency")
    return Finding("unit_incompatible", detail=detail)


# --- words


LONGEST_TEXT = 1000  # characters
_HOMEWORK = str(Path(__file__).parent)  # its files lie beside this folder
_YES = ["yes", "y", "yep", "yeah", "ja", "jawohl", "oui", "si", "wahr", "vrai", "richtig", "verdadero"]
_NO = ["no", "n", "nope", "nein", "non", "falsch", "faux", "falso"]
TRUTH = dict.fromkeys(_YES, "true") | dict.fromkeys(_NO, "false")
_BRACKETED = re.compile(r"\s*[(\[][^()\[\]]*[)\]]\s*")
# The classes of tops: an answer may add, or leave out, `symmetric top` beside them.
CLASSES = frozenset([*get_args(BodyClass), "symmetric"])
STABILITY = ("stable", "unstable", "marginal")
# What the words of many languages say of a top or of stability.
_WORDS = {sense: words.split() for sense, words in table(_HOMEWORK, "choices.csv")}
_TOPS = frozenset(_WORDS.pop("top"))  # what has a class: such a word says nothing itself
SENSES = {word: sense for sense, words in _WORDS.items() for word in words}
# What is not unstable is stable.
_ONE_SPELLING = rules(
    (r"\w+", lambda word: SENSES.get(word[0], word[0])),
    (r"\b(?:not|non|nicht|pas|no) stable\b", "unstable"),
    (r"\b(?:not|non|nicht|pas|no) unstable\b", "stable"),
    (r"(?<=stable) (?:equilibrium|motion|point|position|rotation|state)\Z", ""),
    (r"\A(?:equilibre|equilibrio|mouvement|movimiento) (?=(?:un)?stable\Z)", ""),
)
# Signs that deny what follows: `≠ oblate`, `!stable`.
_NOT = re.compile(r"(?:≠|¬|<>|(?<!\S)(?:!=?|=?/=))\s*(?=\w)")
# Letters of European languages without their accents; dots over other letters are derivatives.
_ACCENTED, _BARE = "àáâäçèéêëìíîïñòóôöùúûü", "aaaaceeeeiiiinoooouuuu"
_WITHOUT_ACCENTS = str.maketrans(_ACCENTED + _ACCENTED.upper(), _BARE + _BARE.upper())
_ARTICLE = re.compile(
    r"\b(?:the|an?|der|die|das|eine?|le|la|une?(?! stable)|el|los|only|nur|body|system|motion) (?=\w)"
    r"|(?<=\w) only\b|(?<=\w\w) (?:axis|achse)\Z"
)
# A subject that claims nothing by itself: `I doubt that it is stable` is left to a person.
_SUBJECT = re.compile(
    r"^(?:(?:(?:body|top|system|motion|rotation|orbit|equilibrium|state|point|position|class|type|answer|it"
    r"|this|about|around|of|for|at|here|so|then|intermediate|axis|e ?[123]|[xyz]|korper|kreisel|bewegung"
    r"|drehung|gleichgewicht|lage|mouvement|equilibre|toupie|movimiento|equilibrio|posicion|trompo"
    r") )*(?:is|ist|est|es|(?:will|should|must) be) )+"
)
_WHY = r"\b(?:because|since|as|weil|denn|car|parce|porque|with)\b"
_REASON = re.compile(rf"\s*(?:[,;:–—]|\. |\s-\s|(?={_WHY}))")  # what stands before a reason
_AND = re.compile(r"[,;]|\b(?:and|und|et|y)\b|&")
_OPPOSITE = re.compile(r"\b(?:yes|no|ja|nein|oui|true|false)\b")
_DOUBTFUL = re.compile(
    r"\b(?:not|no|or|but|nicht|oder|aber|kein|non|pas|ou|mais|wrong|false|incorrect|falsch|faux)\b"
)
_HEDGE = re.compile(r"\A(?:almost|nearly|hardly|quasi|fast|presque|casi) ")
# The end of `yes, it is not`; the reason in `yes, it does not depend on t` denies something else.
_TAKEN_BACK = re.compile(r"\b(?:not|nicht|pas|no)\Z|\A(?:it|das|es) (?:is|ist) (?:not|nicht) \w+\Z")
# Blanks and hyphens between words; a hyphen before the first word may be a minus sign.
_BETWEEN = re.compile("(?<=\\w)[\\s_\\-\N{HYPHEN}\N{NON-BREAKING HYPHEN}\N{EN DASH}]+(?=\\w)")


@dataclass(frozen=True, slots=True)
class ChoiceKey:
    """The right `text`, its `plain` form, to which answers are held, and the `words` of a table for it."""

    text: str
    plain: str | frozenset[str]
    words: str = ""

    def is_met(self, value: str) -> bool:
        """Whether an answer has the words of the key, of the table, or the key and some of these."""
        plain, own = str(self.plain), _plain(self.words.partition(":")[0])
        joined = re.sub(r"\A(\w) (\w+)\Z", r"\1\2", plain)  # pphi for p_phi
        is_part = set(plain.split()) <= set(value.split()) <= set(own.split())
        return value in (plain, joined, own, _plain(self.words)) or is_part or _sense(value) == _sense(plain)


class ChoiceKind(AnswerKind):
    """A word, yes or no, or a set of words."""

    name = "choice"
    has_tolerance = False

    def key(self, source: KeySource) -> ChoiceKey:
        value, fields = source.value, () if source.report is None else source.report.fields
        words = next((field.words for field in fields if field.key == ".".join(source.path[1:])), "")
        if isinstance(value, bool | np.bool_):
            value = "true" if value else "false"
        if isinstance(value, list | tuple) and all(isinstance(word, str) for word in value):
            return ChoiceKey(", ".join(value) or "none", frozenset(map(_plain, value)), words)
        if not isinstance(value, str):
            raise ValueProblem("what is asked for is not a text")
        if not _plain(value) or len(value) > LONGEST_TEXT:
            raise ValueProblem(f"the text of a choice has 1 to {LONGEST_TEXT} characters")
        return ChoiceKey(value, _plain(value), words)

    def read(self, key: ChoiceKey, answer: Tree) -> ReadAnswer:
        """A text, or a set of texts where one is asked. Raises Unreadable."""
        if isinstance(key.plain, str):
            return ReadAnswer(_text(answer), _text(answer))
        words = answer if isinstance(answer, list) else _AND.split(_text(answer))
        if len(words) > LONGEST_TEXT:
            raise Unreadable("too_large", f"{len(words)} words")
        nothing = {"none", _plain(key.words) if not key.plain else "none"}
        chosen = frozenset(map(_text, words)) - nothing
        return ReadAnswer(chosen, ", ".join(sorted(chosen)) or "none")

    def judge(self, key: ChoiceKey, value: str | frozenset[str]) -> Outcome:
        is_right, why = value == key.plain, ""
        if isinstance(value, str) and key.plain in TRUTH.values():
            said, *rest = re.split(r"\W+", value, maxsplit=1)
            said, remark = TRUTH.get(said, said), " ".join(rest).rstrip(" .!)]")
            is_denied = key.plain == TRUTH["yes"] and _TAKEN_BACK.search(remark)
            is_hedged = remark in TRUTH or _OPPOSITE.search(remark) is not None  # `y/n`
            is_clear = not (is_denied or value.endswith("?") or is_hedged)
            is_right = said == key.plain and is_clear
            if said not in TRUTH.values():
                why = "it says neither yes nor no"
            elif said == key.plain:
                why = "the right word stands in a longer answer"
        elif isinstance(value, str):
            first, reason = _split(value)
            is_right = key.is_met(value) or (key.is_met(first) and not _DOUBTFUL.search(reason))
            stands = re.search(rf"(?<!\w){re.escape(str(key.plain))}(?!\w)", value) is not None
            is_split = value.replace(" ", "") == str(key.plain).replace(" ", "")  # `un stable`
            sense = _sense(str(key.plain))
            is_hedged = not isinstance(sense, str) and _sense(value) == sense | {"symmetric"}
            if stands or is_split or is_hedged or key.is_met(_HEDGE.sub("", value)):
                why = "the right word stands in a longer answer"
        if why and not is_right:
            return Outcome.review(why)
        return Outcome.correct() if is_right else Outcome.earning(0.0, Finding("outside_tolerance"))

    def typed(self, key: ChoiceKey) -> Tree:
        return key.text


def _text(answer: Tree) -> str:
    if not isinstance(answer, str):
        raise Unreadable("wrong_shape", f"read {shown(answer)}, expected a text")
    if len(answer) > LONGEST_TEXT:
        raise Unreadable("too_large", f"{len(answer)} characters")
    if not (plain := _plain(answer)):
        raise Unreadable("parse_error", "the text is blank")
    return plain


def _sense(words: str) -> str | frozenset[str]:
    """What words say of a top or of stability, in one spelling: `oblate` is an oblate symmetric top."""
    words = rewritten(words, _ONE_SPELLING)
    told = frozenset(re.findall(r"\w+", words))
    if told.isdisjoint(CLASSES):
        return words
    told -= _TOPS
    return told if told.isdisjoint(("oblate", "prolate")) else told - {"symmetric"}


def _split(value: str) -> tuple[str, str]:
    """A word, and the reason that is given for it; a few words behind it may be a second answer."""
    between = _REASON.search(value)
    if between is None:
        return value, ""
    first, reason = value[: between.start()].strip(), value[between.end() :].strip()
    is_reason = re.match(_WHY, reason) or len(reason.split()) > max(2, len(first.split()))
    return (first, reason) if is_reason or not reason else (value, "")


def _unless_opposite(added: re.Match[str]) -> str:
    """A blank for what is added in brackets, unless it may be another answer."""
    words, before = (
        {SENSES.get(word, word) for word in re.findall(r"\w+", text)}
        for text in (added[0], added.string[: added.start()])
    )
    others = {*CLASSES, *TRUTH, *STABILITY} - before
    return added[0] if words & others or _DOUBTFUL.search(added[0]) else " "


def _plain(text: str) -> str:
    """The text in small letters, without articles and decoration, and truth values in one spelling."""
    letters = re.sub(r"\A\s*[-–—]\s+", "", unicodedata.normalize("NFKC", text))
    letters = undecorated(_NOT.sub("not ", letters.translate(_WITHOUT_ACCENTS)))
    with suppress(ValueProblem):  # a brace may stand in a text that is no LaTeX
        letters = without_latex(letters)
    words = re.sub(r"(?<=is)n['’]t\b", " not", letters.casefold())
    words = re.sub(r"\bn['’]est pas\b", "est pas", re.sub(r"\bno es\b", "es no", words))
    words = re.sub(r"\bun-(?=\w)", "un", words)
    words = words.strip("\"'“”„‘’ \n{}").rstrip(".!\n ")
    words = words.strip("()[] ") if _BRACKETED.fullmatch(words) else _BRACKETED.sub(_unless_opposite, words)
    words = _SUBJECT.sub("", _ARTICLE.sub("", _BETWEEN.sub(" ", words.strip()))).strip(" .!")
    return TRUTH.get(words, words)
