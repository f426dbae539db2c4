"""What people write around an answer and no judge reads: marks of Markdown, quotes, `about`, `(3 s.f.)`."""

from __future__ import annotations

import re

LONGEST = 4000
"""The most characters of an answer that anybody decorates: patterns take long for more."""

DECIMAL = r"(?:\d*[.,]\d+|\d+\.?)"
"""The pattern of a decimal number as people type it, without a sign and a power of ten."""

QUOTES = '"“”„‟«»`″'
_PAIRS = {"'": "'", "‘": "’", "‚": "‘", "‹": "›"}

_BEFORE = re.compile(
    r"""(?xi) \s* (?:
      (?:so|thus|hence|therefore|also|donc|somit|daher)\b [,:]?
    | (?:(?:my|the|our|die|das|la|le|el|final)\s+)* (?:answer|ans|result|solution|ergebnis|antwort
        |lösung|réponse|rép|résultat|respuesta|resultado|solución|risposta|risultato)\b
        \.? \s* (?:is|ist|est|es|lautet)?\b
        (?:\s+(?:approximately|about))? \s* [:=]?
    | (?:it|this|that|that's|it's|das|es|c'est) \s+ (?:is|ist|equals)\b | it's\b | c'est\b
    | (?:[^\W\d_]+['’]?\s+){1,7} (?:is|ist|est|es|beträgt|vaut|vale|equals|be|are|sind|sont|son|gives
        |lauten) \s+ (?=[-+~≈]?\s*[\d([{√\\.]|sqrt)
    | (?:(?!in\b)[^\W\d_]+\s+){1,6} [^\W\d_]+ \s* : \s* (?=[-+~≈]?\s*[\d(]) (?=[^:=]*\Z)
    | (?:i|we) \s+ (?:get|got|find|found|obtain|have)\b
    | (?:i\s+think|probably|wahrscheinlich|vermutlich|probablement) \s+ (?=[-+~≈]?\s*[\d.])
    | (?:about|approximately|approx|around|roughly|circa|ca|etwa|ungefähr|ungefaehr|rund|environ|env
        |unos|aproximadamente|aprox|nearly|almost|à\ peu\ près|más\ o\ menos|c(?=\.\s))\b \.?
    | (?:[•▪‣] | · \s | \* \s+) (?=\S)
    | \#+ \s
    | [≈~≃≅∼∴] | => | ⇒ | -{1,2}>
    ) \s*"""
)
_BEHIND = re.compile(
    r"""(?xi) \s* (?:
      [(\[] \s* (?: (?:to\s+|auf\s+)? \d \s* (?: s\.?\s*f\.?
        | sig\.?(?:nificant)?\s*fig(?:ure)?s?\.? | d\.?\s*p\.? | decimals?
        | decimal\s+places? | gültige\s+ziffern | stellen | c\.?\s*s\.? )
        | approx(?:\.|imately)? | about | rounded | gerundet | arrondi | ca\.? | exact(?:ly)?
        | SI(?:\s+units)? ) \s* [)\]]
    | [(\[] \s* (?: exact(?:ly)? | i\.e\.? | unrounded | [≈=] ) [^()\[\]]* [)\]]
    | \s (?:to\s+) \d \s* (?: s\.?\s*f\.? | sig\.?\s*figs?\.? | significant\s+figures | decimal\s+places? )
    | \s (?:approx(?:\.|imately)? | rounded | gerundet)
    | (?<=[^\s.\\]) (?<!right) [.!]+ | (?<!\\) [,;]
    ) \s* \Z"""
)
_UNIT_AHEAD = re.compile(
    r"(?:[^\d:=,;()]*\s)?in\s+(?P<unit>[^\W\d_][\w^/·*²³ -]{0,15})\s*[:=]\s*(?P<value>[^:=]*[\d)\]}])",
    re.DOTALL,
)
"""A unit in front: `E in J: 12.5`."""

_LABEL = re.compile(r"\s*\(?(?P<label>[a-h]|i{1,3}|iv|[1-9])[.)]\s+", re.IGNORECASE)
"""What stands before the parts of an answer: `a)`, `(1)`, `2.`, `iii)`."""

_SEQUENCES = ("a", "b", "c", "d", "e", "f", "g", "h"), ("i", "ii", "iii", "iv"), tuple("123456789")

_UNIT = r"[^\W\d_][\w^/. ·*²³⁻-]*?"
_UNCERTAINTY = re.compile(
    rf"(?P<open>\()?(?P<value>\d[\d.,]*(?:[eE][-+]?\d+)?(?P<unit>\s*{_UNIT})?)\s*(?:±|\+/?[-−]|-/?\+|\\pm)\s*"
    rf"{DECIMAL}(?:\s*%)?(?(unit)(?:\s*{_UNIT}(?=\s*\)?\s*\Z))?)\s*(?(open)\)|(?![\w(]*\())"
)

_TAG = re.compile(r"</?(?:br|p|b|i|em|strong|div|span)\b[^<>]*>|&nbsp;")


def undecorated(text: str) -> str:
    """The text of an answer without what stands around it."""
    before = ""
    text = text.strip()
    if len(text) > LONGEST:
        return text
    if "<" in text or "&" in text:  # from an editor in a browser
        text = re.sub(r"<sup>(.*?)</sup>", r"^(\1)", re.sub(r"<sub>(.*?)</sub>", r"_\1", text))
        text = _TAG.sub(" ", text).strip()
    text = without_labels(text)
    if ahead := _UNIT_AHEAD.fullmatch(text):
        text = f"{ahead['value']} {ahead['unit'].strip()}"
    while text != before:
        before = text
        if text.startswith(("**", "__")) and text.count(text[:2]) > 1:
            text = text[2:].replace(text[:2], "", 1)
        if len(text) > 2 and text[0] == text[-1] and text[0] in "*_" and text.count(text[0]) == 2:
            text = text[1:-1]
        if text[:1] in QUOTES or (text[-1:] in QUOTES and not re.search(r"\d\s*[\"″]\Z", text)):
            text = text.strip(QUOTES)
        if len(text) > 1 and _PAIRS.get(text[0]) == text[-1]:
            text = text[1:-1]
        text = _BEHIND.sub("", text)
        begun = _BEFORE.match(text)
        text = (text if begun is None or begun.end() == len(text) else text[begun.end() :]).strip()
    return text


def without_labels(text: str) -> str:
    """A text without the labels before its lines, if they count these: `1) 3` and `2) 5` are `3` and `5`.

    One line alone has a label only where its bracket is open on one side, as in `a) 3`.
    """
    lines = [line for line in text.splitlines() if line.strip()]
    matches = [match for line in lines if (match := _LABEL.match(line))]
    labels = tuple(match["label"].lower() for match in matches)
    is_counted = any(labels == each[: len(labels)] for each in _SEQUENCES)
    if not labels or len(labels) < len(lines) or not is_counted:
        return text
    if len(lines) == 1 and ("(" in matches[0][0] or ")" not in matches[0][0]):
        return text
    return "\n".join(line[match.end() :] for line, match in zip(lines, matches, strict=True))


def without_uncertainty(text: str) -> str:
    """A number without the uncertainty behind it: `(3.12 ± 0.02) m` is `3.12 m`."""
    return _UNCERTAINTY.sub(lambda match: f"{match['value']} ", text)
