"""The judge: was every stage done once, is every record and every hash as without faults, is every error named."""

from collections import Counter, defaultdict
from dataclasses import dataclass, field
from statistics import median

from benchmarks.lab_soak.record import Event
from benchmarks.lab_soak.said import NAMED, name_of

AFTER = 120.0  # [s] after a fault is over in which a line may still speak of it
FINISHED = "FINISHED"


@dataclass
class Verdict:
    """Verdict on a soak; it holds where `broken` is empty."""

    broken: list[str] = field(default_factory=list)
    faults: list[list[str]] = field(default_factory=list)
    """Rows: kind, how often, starts that ended badly, seconds until the next stage ended: median, longest."""
    lines: Counter[str] = field(default_factory=Counter)
    """Name of an error -> in how many starts it was said."""
    counts: dict[str, float] = field(default_factory=dict)

    def table(self) -> str:
        """Markdown."""
        rows = ["| fault | times | starts that failed | next stage after [s], median | longest |"]
        rows.append("|---|---|---|---|---|")
        rows += [f"| {' | '.join(row)} |" for row in self.faults]
        rows += ["", *(f"- {name}: {value:g}" for name, value in self.counts.items()), ""]
        rows += ["| error, by name | starts that said it |", "|---|---|"]
        rows += [f"| {name} | {count} |" for name, count in self.lines.most_common()]
        return "\n".join([*rows, "", *(f"BROKEN {line}" for line in self.broken), f"{len(self.broken)} broken"])


def judge(events: list[Event]) -> Verdict:
    """The verdict on the lines of a record."""
    references = {event["seed"]: event for event in events if event["what"] == "reference"}
    loops = [event for event in events if event["what"] == "loop"]
    sha = next((event["git_sha"] for event in events if event["what"] == "begin"), None)
    found = Verdict()
    for loop in loops:
        against = references.get(loop["seed"])
        if against is None:
            found.broken.append(f"loop {loop['loop']}: no reference of seed {loop['seed']}")
            continue
        wrong = [*stages(loop, against), *files(loop, against), *runs(loop, against, sha, published(loop, loops))]
        found.broken += [f"loop {loop['loop']}, seed {loop['seed']}: {line}" for line in wrong]
    found.broken += starts(events)
    found.broken += unnamed(events, found.lines)
    found.broken += [f"{e['what']}: {e['kind']}: {e['error']}" for e in events if e["what"] == "fault failed"]
    if not loops:
        found.broken.append("no loop was finished")
    found.faults = recovery(events)
    ended = [event["at"] for event in events]
    stands = next((event["at"] for event in events if event["what"] == "stands"), ended[0])
    found.counts = {
        "minutes under faults": round((max(ended) - stands) / 60, 1),
        "loops finished": len(loops),
        "stages finished": sum(event["what"] == "stage" for event in events),
        "runs in MLflow of finished loops": sum(len(loop["runs"]) for loop in loops),
        "files compared": sum(len(loop["files"]) for loop in loops),
        "faults": sum(event["what"] == "fault" for event in events),
        "faults that found nothing to hit": sum(event["what"] == "fault missed" for event in events),
        "seconds between two stages of a start without a fault between, median": undisturbed(events),
        "starts": sum(event["what"] == "start" for event in events),
    }
    return found


def stages(loop: Event, against: Event) -> list[str]:
    """Stages that are not there, or too many."""
    missing, more = set(against["stages"]) - set(loop["stages"]), set(loop["stages"]) - set(against["stages"])
    return [f"stage {name} is missing" for name in sorted(missing)] + [f"stage {name} is new" for name in sorted(more)]


def files(loop: Event, against: Event) -> list[str]:
    """Files that differ from those without faults."""
    ours, theirs = loop["files"], against["files"]
    found = [f"{name}: no such file" for name in sorted(set(theirs) - set(ours))]
    found += [f"{name}: a file that the reference has not" for name in sorted(set(ours) - set(theirs))]
    return found + [f"{name}: another hash" for name in sorted(set(ours) & set(theirs)) if ours[name] != theirs[name]]


def published(loop: Event, loops: list[Event]) -> set[str]:
    """Runs of the registry by earlier loops of the seed: an equal policy is no new version, and leaves no new run."""
    earlier = (other for other in loops if other["seed"] == loop["seed"] and other["loop"] < loop["loop"])
    return {run["name"] for other in earlier for run in other["runs"] if run["versions"]}


def runs(loop: Event, against: Event, sha: str | None, known: set[str]) -> list[str]:
    """Records that are lost, doubled, not finished or not whole; `known` need not be there again."""
    wanted = {run["name"]: run for run in against["runs"]}
    done = Counter(run["name"] for run in loop["runs"] if run["status"] == FINISHED)
    found = [f"run `{name}` is lost" for name in sorted(set(wanted) - set(done) - known)]
    found += [f"run `{name}` is there {count} times" for name, count in sorted(done.items()) if count > 1]
    found += [f"run `{name}` is new" for name in sorted(set(done) - set(wanted))]
    for run in loop["runs"]:
        if run["status"] != FINISHED:
            found.append(f"run `{run['name']}` is {run['status']}, beside {done[run['name']]} finished")
        elif run["name"] in wanted:
            found += [f"run `{run['name']}`: {line}" for line in partial(run, wanted[run["name"]], sha)]
    return found


def partial(run: Event, wanted: Event, sha: str | None) -> list[str]:
    """Differences of a finished run from its reference."""
    keys = ("params", "points", "stage", "versions")
    found = [f"{key} {run[key]}, expected {wanted[key]}" for key in keys if run[key] != wanted[key]]
    if files_of(run) != files_of(wanted):
        found.append(f"its files differ by {sorted(set(files_of(run)) ^ set(files_of(wanted)))}")
    if run["git_sha"] != sha:
        found.append(f"commit {run['git_sha']}, expected {sha}")
    return found + ([] if run["lineage"] else ["lineage.json is not the one that its tag names"])


def files_of(run: Event) -> list[str]:
    """A run's files."""
    return sorted(run["files"])


def starts(events: list[Event]) -> list[str]:
    """Loops that hung, or did not end well however often they were started; the one at work at the end is let off."""
    ends: dict[int, list[Event]] = defaultdict(list)
    for event in events:
        if event["what"] == "end":
            ends[event["loop"]].append(event)
    found = [f"loop {n}, start {e['attempt']}: hung" for n, some in ends.items() for e in some if e["status"] == "hung"]
    last = max(ends, default=0)
    read = {event["loop"] for event in events if event["what"] == "loop"}
    found += [
        f"loop {n}: done, and never read" for n, some in ends.items() if some[-1]["status"] == 0 and n not in read
    ]
    return found + [f"loop {n}: given up" for n, some in ends.items() if some[-1]["status"] != 0 and n != last]


def unnamed(events: list[Event], counter: Counter[str]) -> list[str]:
    """Lines that tell of an error without a name, or of one whose fault was not there."""
    intervals = active(events)
    found, began = [], 0.0
    for event in events:
        if event["what"] == "start":
            began = event["at"]
        if event["what"] != "end":
            continue
        names = {line: name_of(line) for line in event["said"]}
        counter.update({name for name in names.values() if name is not None})
        there = {kind for kind, at, until in intervals if at <= event["at"] and until + AFTER >= began}
        where = f"loop {event['loop']}, start {event['attempt']}"
        for line, name in names.items():
            if name is None:
                found.append(f"{where}: an error without a name: {line}")
            elif NAMED[name][1] and not there & set(NAMED[name][1]):
                found.append(f"{where}: {name}, without such a fault: {line}")
    return found


def active(events: list[Event]) -> list[tuple[str, float, float]]:
    """(kind, from, until) of every fault; to the end of the record for one that was not undone."""
    end, found = events[-1]["at"], []
    for index, event in enumerate(events):
        if event["what"] == "fault":
            after = (e["at"] for e in events[index:] if e["what"] == "restored" and e["kind"] == event["kind"])
            found.append((event["kind"], event["at"], next(after, end)))
    return found


def undisturbed(events: list[Event]) -> float:
    """How long it takes from the end of a stage to that of the next one where no fault comes between."""
    found, before, intervals = [], None, active(events)
    for event in events:
        if event["what"] == "stage":
            if before is not None and not any(at <= event["at"] and until >= before for _, at, until in intervals):
                found.append(event["at"] - before)
            before = event["at"]
        elif event["what"] == "start":
            before = None
    return round(median(found), 1) if found else 0.0


def recovery(events: list[Event]) -> list[list[str]]:
    """A row for each kind."""
    done = [event["at"] for event in events if event["what"] == "stage"]
    bad = [event["at"] for event in events if event["what"] == "end" and event["status"] != 0]
    seconds: dict[str, list[float]] = defaultdict(list)
    ended: Counter[str] = Counter()
    times: Counter[str] = Counter()
    for kind, at, until in active(events):
        times[kind] += 1
        if (after := [each for each in done if each >= until]) != []:
            seconds[kind].append(after[0] - at)
            ended[kind] += any(at <= each <= after[0] for each in bad)
    rows = []
    for kind, count in sorted(times.items()):
        own = seconds[kind]
        figures = [f"{median(own):.0f}", f"{max(own):.0f}"] if own else ["-", "-"]
        rows.append([kind, str(count), str(ended[kind]), *figures])
    return rows
