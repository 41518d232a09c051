"""Bad effects files and formulas by hand: what each is called, and what writes it."""

import os
from collections.abc import Callable
from pathlib import Path

Make = Callable[[Path], object]


def text(content: str) -> Make:
    return lambda path: path.write_text(content)


def entry(content: str) -> Make:
    return text(f"schema: 1\neffects:\n- {content}\n")


def armature(value: str) -> Make:
    return entry(f"{{effect: armature, where: [j], parameters: {{armature: {value}}}}}")


def discovered(terms: str) -> Make:
    return entry(f"{{effect: discovered, where: [j], parameters: {{terms: {terms}}}}}")


BOMB = "a0: &a0 [x, x]\n" + "".join(f"a{i}: &a{i} [*a{i - 1}, *a{i - 1}]\n" for i in range(1, 30))

EFFECTS_FILES: dict[str, Make] = {
    "nothing there": lambda path: None,
    "a folder": lambda path: path.mkdir(),
    "a pipe": lambda path: os.mkfifo(path),
    "a link to /dev/zero": lambda path: path.symlink_to("/dev/zero"),
    "a link in a circle": lambda path: path.symlink_to(path.name),
    "empty": text(""),
    "bytes": lambda path: path.write_bytes(bytes(range(256))),
    "utf-16": lambda path: path.write_bytes("schema: 1\neffects: []".encode("utf-16")),
    "a list": text("[1, 2]"),
    "a word": text("hello"),
    "5,000 levels of lists": text("[" * 5000 + "]" * 5000),
    "5,000 levels of tables": text("schema: 1\neffects: " + "{a: " * 5000 + "1" + "}" * 5000),
    "5,000 levels, not closed": text("[" * 5000),
    "aliases that multiply": text(BOMB + "schema: 1\neffects: []"),
    "an alias to itself": text("schema: 1\neffects: &a [*a]"),
    "an alias to nothing": text("schema: 1\neffects: *a"),
    "a tag that calls": text("!!python/object/apply:os.system [touch executed]"),
    "a tag for bytes": text("schema: 1\neffects: !!binary aGVsbG8="),
    "two documents": text("schema: 1\neffects: []\n---\nschema: 1\neffects: []"),
    "no effects": text("schema: 1"),
    "effects null": text("schema: 1\neffects:"),
    "effects a table": text("schema: 1\neffects: {a: 1}"),
    "schema true": text("schema: true\neffects: []"),
    "schema text": text("schema: '1'\neffects: []"),
    "an unknown key": text("schema: 1\neffects: []\nextra: 1"),
    "a key twice": text("schema: 1\neffects: []\neffects: [{effect: armature, where: [j], parameters: {armature: 1}}]"),
    "a parameter twice": entry("{effect: armature, where: [j], parameters: {armature: 1, armature: 2}}"),
    "a list as key": text("? [a]\n: 1\nschema: 1\neffects: []"),
    "3,000 effects": text(
        "schema: 1\neffects:\n" + "- {effect: armature, where: [j], parameters: {armature: 1}}\n" * 3_000
    ),
    "an entry that is a word": entry("armature"),
    "an effect that is unknown": entry("{effect: magic, where: [j], parameters: {}}"),
    "an effect that is a list": entry("{effect: [armature], where: [j], parameters: {}}"),
    "the same effect twice": text(
        "schema: 1\neffects:\n" + "- {effect: armature, where: [j], parameters: {armature: 1}}\n" * 2
    ),
    "where a word": entry("{effect: armature, where: j, parameters: {armature: 1}}"),
    "where empty": entry("{effect: armature, where: [], parameters: {armature: 1}}"),
    "where of numbers": entry("{effect: armature, where: [1], parameters: {armature: 1}}"),
    "where twice the same": entry("{effect: armature, where: [j, j], parameters: {armature: 1}}"),
    "where an empty name": entry("{effect: armature, where: [''], parameters: {armature: 1}}"),
    "a name of 10 MB": entry(f"{{effect: armature, where: [{'j' * 10_000_000}], parameters: {{armature: 1}}}}"),
    "a name of 100 kB": entry(f"{{effect: armature, where: [{'j' * 100_000}], parameters: {{armature: 1}}}}"),
    "parameters missing": entry("{effect: armature, where: [j]}"),
    "parameters a list": entry("{effect: armature, where: [j], parameters: [1]}"),
    "a parameter too many": entry("{effect: armature, where: [j], parameters: {armature: 1, mass: 1}}"),
    "a parameter missing": entry("{effect: armature, where: [j], parameters: {}}"),
    "a number as text": armature("'1.0'"),
    "nan": armature(".nan"),
    "infinite": armature(".inf"),
    "1e300": armature("1.0e+300"),
    "a whole number of 400 digits": armature("1" + "0" * 400),
    "a whole number of 5,000 digits": armature("1" * 5000),
    "negative": armature("-1"),
    "true": armature("true"),
    "null": armature("null"),
    "a date": armature("2020-01-01"),
    "a date that is none": armature("2020-99-99"),
    "a complex number": armature("1+2j"),
    "a list for a number": armature("[1]"),
    "terms missing": entry("{effect: discovered, where: [j], parameters: {}}"),
    "terms empty": discovered("[]"),
    "a term that is a number": discovered("[{term: 5, coefficient: 1}]"),
    "a term missing": discovered("[{coefficient: 1}]"),
    "a term twice": discovered("[{term: q, coefficient: 1}, {term: q, coefficient: 2}]"),
    "a term that is code": discovered('[{term: \'__import__("os").system("touch executed")\', coefficient: 1}]'),
    "a coefficient of nan": discovered("[{term: q, coefficient: .nan}]"),
    "a coefficient of 400 digits": discovered(f"[{{term: q, coefficient: 1{'0' * 400}}}]"),
    "a coefficient of 1e300": discovered("[{term: q, coefficient: 1.0e+300}]"),
    "a coefficient as text": discovered("[{term: q, coefficient: '1'}]"),
}

TERMS: dict[str, str] = {
    "nothing": "",
    "blanks": "   ",
    "no formula": "q +",
    "two formulas": "q; v",
    "an assignment": "q = v",
    "a named assignment": "(q := v)",
    "a call of the system": "__import__('os').system('touch executed')",
    "an attribute": "q.__class__",
    "a lambda": "lambda: q",
    "a list": "[q for q in v]",
    "a text": "'q'",
    "a text with a format": "f'{q}'",
    "a comparison": "q < v",
    "true": "True",
    "None": "None",
    "an ellipsis": "...",
    "an unknown name": "mass",
    "an unknown function": "sqrt(q)",
    "a function of two": "sin(q, v)",
    "a named argument": "sin(x=q)",
    "friction of two": "friction(q, v)",
    "friction of nothing": "friction()",
    "friction of something named too": "friction(q, bound=2)",
    "friction inside": "1 + friction(q)",
    "stars": "sin(*q)",
    "a complex number": "q * 1j",
    "an infinite number": "q * 1e999",
    "a number of 400 digits": "q * 1" + "0" * 400,
    "a number of 1,900 digits": "q * " + "9" * 1900,
    "an infinite point": "curve(q, 0, 1e999, 1, 2)",
    "a point of 400 digits": "curve(q, 0, 1" + "0" * 400 + ", 1, 2)",
    "a point that is true": "curve(q, 0, True, 1, 2)",
    "a step that is true": "stair(q, True)",
    "an infinite step": "stair(q, 1e999)",
    "an infinite time": "rested(1e999, 1)",
    "points that do not ascend": "curve(q, 1, 0, 1, 0)",
    "a power of a power": "q^9",
    "a power of a quantity": "q^v",
    "a negative power": "q^-1",
    "a power without end": "9^9^9^9",
    "brackets of brackets": "tau[tau[a]]",
    "brackets behind u": "u[a]",
    "a slice": "q[1:2]",
    "10 MB": "q+" * 5_000_000 + "q",
    "900 levels of signs": "-" * 900 + "q",
    "900 levels of functions": "sin(" * 300 + "q" + ")" * 300,
    "900 terms": "q+" * 900 + "q",
    "1,900 brackets": "(" * 950 + "q" + ")" * 950,
    "NUL": "q\0",
    "half a letter": "q\ud800",
}
