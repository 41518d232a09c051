"""HTML of replays: the players of a report, and a page of its own for one replay."""

from importlib.resources import files

from jinja2 import Template
from markupsafe import Markup

from bumblebee.io.page_policy import policy_tag
from bumblebee.report.replays.replay import Part, Take
from bumblebee.report.replays.replay_still import still_uri

_STYLE = """:root{color-scheme:light dark}
body{font:15px/1.55 system-ui,"Segoe UI",Roboto,sans-serif;max-width:760px;margin:0 auto;padding:12px 16px}
body{color:#22262b;background:#fff}h1{font-size:19px;margin:0}figcaption{color:#59626d;font-size:13.5px}
@media (prefers-color-scheme:dark){body{color:#e6e9ed;background:#16191d}figcaption{color:#a3adb8}}"""


def player(take: Take, title: str, caption: str = "") -> Markup:
    """A player of all replays of a group; without scripts or WebGL it is a picture of this one."""
    moments = f"{take.name}: {', '.join(robot.name for robot in take.robots)}; four moments of {_seconds(take):.1f} s."
    template = Template(_file("replay.html.j2"), autoescape=True)
    return Markup(template.render(group=take.group, title=title, caption=caption, uri=still_uri(take), alt=moments))


def holder(part: Part) -> Markup:
    """The replays' data, hidden; once a page."""
    return Markup('<pre class="replays" hidden>{}</pre>').format(part.data)


def script() -> str:
    """The players' script."""
    return _file("replay.js")


def style() -> str:
    """The players' style."""
    return _file("replay.css")


def replay_page(take: Take, part: Part) -> str:
    """A page that shows one replay, from `file://` too."""
    view = "<meta name='viewport' content='width=device-width,initial-scale=1'>"
    head = Markup("<meta charset='utf-8'>{}{}<title>{}</title><style>{}{}</style>").format(
        Markup(policy_tag(script())), Markup(view), take.name, Markup(_STYLE), Markup(style())
    )
    body = Markup("<h1>{}</h1>").format(take.name) + player(take, "", part.note) + holder(part)
    return f"<!doctype html><html lang='en'><head>{head}</head><body>{body}<script>{script()}</script></body></html>\n"


def _file(name: str) -> str:
    return files("bumblebee.report").joinpath(name).read_text()


def _seconds(take: Take) -> float:
    return (len(take.states) - 1) / take.fps
