"""Captions in HumanML3D's line format: `caption#word/TAG word/TAG ...#from#to`, from and to 0.0 for the whole clip.

As in HumanML3D, nouns and verbs stand in their base form (except "left") and punctuation is dropped.
"""

from bumblebee.errors import BadInput

_WORDS = {
    "DET": "a the each both its",
    "ADP": "with to in on from at of over for behind into onto around toward",
    "CCONJ": "and",
    "SCONJ": "while",
    "PRON": "their they it them something",
    "NUM": "one two three four ninety",
    "ADV": "slowly quickly forward backward backwards up down together then straight out sideways calmly again ahead "
    "overhead low apart far twice deeply slightly sharply steadily",
    "ADJ": "left right small slow fast full deep shallow big short normal steady single other quick half large high",
    "PART": "not",
    "AUX": "is",
}


def _own(words: str) -> dict[str, str]:
    return {word: word for word in words.split()}


_LEMMAS = {
    "NOUN": {
        **_own(
            "person hand arm body leg foot knee chest side place circle floor step head torso waist front ground "
            "weight pace curve jump squat stand balance air kick punch hip way degree man hop bow robot shoulder turn "
            "walk direction someone guard lunge march elbow"
        ),
        **{"hands": "hand", "arms": "arm", "legs": "leg", "feet": "foot", "knees": "knee", "circles": "circle",
           "steps": "step", "degrees": "degree", "punches": "punch", "squats": "squat", "elbows": "elbow",
           "sides": "side", "hips": "hip", "shoulders": "shoulder", "times": "time", "time": "time", "hops": "hop",
           "jumps": "jump"},
    },
    "VERB": {
        "waves": "wave", "waving": "wave", "raises": "raise", "lifts": "lift", "lowers": "lower", "claps": "clap",
        "draws": "draw", "points": "point", "pointing": "point", "looks": "look", "turns": "turn", "bends": "bend",
        "bows": "bow", "sways": "sway", "shifts": "shift", "twists": "twist", "shrugs": "shrug", "throws": "throw",
        "swings": "swing", "holds": "hold", "stretches": "stretch", "spreads": "spread", "puts": "put",
        "reaches": "reach", "picks": "pick", "touches": "touch", "crouches": "crouch", "walks": "walk",
        "walking": "walk", "strolls": "stroll", "steps": "step", "stepping": "step", "marches": "march",
        "marching": "march", "jumps": "jump", "stands": "stand", "standing": "stand", "kicks": "kick",
        "balances": "balance", "moves": "move", "goes": "go", "comes": "come", "leans": "lean", "does": "do",
        "rotates": "rotate", "makes": "make", "keeps": "keep", "boxes": "box", "stays": "stay", "takes": "take",
        "cheers": "cheer", "squats": "squat", "hops": "hop", "circles": "circle", "punches": "punch",
        "returns": "return", "extends": "extend", "rests": "rest", "crouching": "crouch", "sinks": "sink",
    },
}  # fmt: skip
_BY_CONTEXT = {"NOUN": ("DET", "ADJ", "NUM", "ADP"), "VERB": ("NOUN", "PRON", "CCONJ", "ADV")}
"""A word that may be both ("steps") is a noun after the first and a verb after the second."""


def caption_line(text: str) -> str:
    """The caption with its tagged tokens; every word must be in the lexicon."""
    tokens: list[tuple[str, str]] = []
    for word in text.replace(",", "").replace(".", "").split():
        tokens.append(_tag(word, tokens[-1][1] if tokens else "", text))
    return f"{text}#{' '.join(f'{word}/{tag}' for word, tag in tokens)}#0.0#0.0"


def _tag(word: str, before: str, text: str) -> tuple[str, str]:
    options = [tag for tag, lemmas in _LEMMAS.items() if word in lemmas]
    if len(options) == 2:
        options = ["NOUN"] if before in _BY_CONTEXT["NOUN"] else ["VERB"]
    if options:
        return _LEMMAS[options[0]][word], options[0]
    for tag, words in _WORDS.items():
        if word in words.split():
            return word, tag
    raise BadInput(f"caption {text!r}, word {word!r}", "a word of the lexicon", "an unknown one", "Add it to _WORDS.")
