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
    | (?:(?:my|the|our|die|das|la|le|el|final)\s+)* (?:answer|ans|result|solution|ergebnis|antwort|lösung
        |réponse|résultat|respuesta|resultado|solución)\b \.? \s* (?:is|ist|est|es|lautet)?\b
        (?:\s+(?:approximately|about))? \s* [:=]?
    | (?:it|this|that|that's|it's|das|es|c'est) \s+ (?:is|ist|equals)\b | it's\b | c'est\b
    | (?:[^\W\d_]+['’]?\s+){1,7} (?:is|ist|est|es|beträgt|vaut|equals) \s+ (?=[-+~≈]?\s*[\d(√\\.]|sqrt)
    | (?:i|we) \s+ (?:get|got|find|found|obtain|have)\b
    | (?:about|approximately|approx|around|roughly|circa|ca|etwa|ungefähr|ungefaehr|rund|environ|env
        |unos|aproximadamente|nearly|almost)\b \.?
    | [•▪‣·] \s | \* \s+ (?=\S)
    | \#+ \s
    | [≈~≃≅∼∴] | => | ⇒
    ) \s*"""
)
_BEHIND = re.compile(
    r"""(?xi) \s* (?:
      [(\[] \s* (?: (?:to\s+|auf\s+)? \d \s* (?: s\.?\s*f\.?
        | sig\.?(?:nificant)?\s*fig(?:ure)?s?\.? | d\.?\s*p\.? | decimals?
        | decimal\s+places? | gültige\s+ziffern | stellen | c\.?\s*s\.? )
        | approx(?:\.|imately)? | about | rounded | gerundet | arrondi | ca\.? | exact(?:ly)? ) \s* [)\]]
    | [(\[] \s* (?: exact(?:ly)? | i\.e\.? | unrounded | [≈=] ) [^()\[\]]* [)\]]
    | \s (?:to\s+) \d \s* (?: s\.?\s*f\.? | sig\.?\s*figs?\.? | significant\s+figures | decimal\s+places? )
    | \s (?:approx(?:\.|imately)? | rounded | gerundet)
    | (?<=[^\s.\\]) (?<!right) [.!]+ | (?<!\\) [,;]
    ) \s* \Z"""
)
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


def without_uncertainty(text: str) -> str:
    """A number without the uncertainty behind it: `(3.12 ± 0.02) m` is `3.12 m`."""
    return _UNCERTAINTY.sub(lambda match: f"{match['value']} ", text)
