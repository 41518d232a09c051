"""A run sheet as one self-contained page: motions in the order of their risk, what to watch, when to stop."""

from bumblebee.report.page import Block, Cell, Section, note, pairs, render, table, text, warning
from bumblebee.wire.operator.sheet import Sheet, Tried
from bumblebee.wire.operator.sheet_file import watch
from bumblebee.wire.safety.uses import DAMPING

_HEADER = ("motion", "not to its end [95 %]", "fell", "damped", "largest tilt", "nearest joint end", "watch")


def sheet_page(sheet: Sheet) -> str:
    """The page's HTML."""
    sections = [
        Section("order", "Motions, the least risky first", tuple(_order(sheet))),
        Section("limits", "Share of the guard's limits", (_uses(sheet),)),
        Section("stop", "When to stop", tuple(_stop(sheet))),
    ]
    subtitle = f"policy {sheet.policy} ({sheet.sha256[:12]}), {sheet.robots} robots drawn with seed {sheet.seed}"
    return render("Run sheet", subtitle, "", sections)


def _order(sheet: Sheet) -> list[Block]:
    blocks = [
        text(
            f"Each motion was followed in simulation on {sheet.robots} robots that differ in mass, gains, friction, "
            "delay and pushes, as in the paper's table of domain randomisation. Run from the top; a motion below one "
            "that went wrong is not for today."
        ),
        pairs(_HEADER, [_row(one) for one in sheet.tried], "motions by risk"),
        note(
            "fell: leant or sank beyond the guard's limits. damped: did not fall, but another rule would have damped, "
            "which leaves a robot on its feet to fall. Tilt and joint ends: on the robots that did not fall, or on all "
            "where all did. Rows are at 50 Hz."
        ),
    ]
    if sheet.untried:
        blocks.append(warning(f"Not tried, the time was over: {', '.join(sheet.untried)}."))
    return blocks


def _row(one: Tried) -> tuple[str | Cell, ...]:
    low, high = one.ci95
    share = f"{100 * one.share:.0f} % [{100 * low:.0f}, {100 * high:.0f}]"
    end = f"{abs(one.room_rad):.2f} rad{' beyond' if one.room_rad < 0 else ''}, {one.room_joint}"
    fell, damped = (f"{count} of {one.robots}" for count in (one.fell, one.damped))
    return one.motion, share, fell, damped, f"{one.tilt_deg:.0f}°", end, watch(one)


def _uses(sheet: Sheet) -> Block:
    rules = [*DAMPING, "torque"]
    rows: list[list[str | Cell]] = [[one.motion, *(_use(one, rule) for rule in rules)] for one in sheet.tried]
    caption = (
        "Largest on any robot that did not fall. At 100 % the rule acts; red is beyond. Torque is cut, the others damp."
    )
    return table(("motion", *rules), rows, caption, "share of the guard's limits")


def _use(one: Tried, rule: str) -> Cell:
    share, joint, at = one.uses[rule]
    return Cell(f"{100 * share:.0f} %", mark="missed" if share > 1 else "", tip=f"{joint or 'pelvis'} at {at:.1f} s")


def _stop(sheet: Sheet) -> list[Block]:
    limits = sheet.limits
    rows = [
        ("tilt", f"{limits['tilt_deg']:g}° from the reference, or {limits['drop_m']:g} m below it"),
        ("joint_range", f"{100 * limits['beyond']:g} % of a joint's range beyond its end"),
        ("speed", f"{100 * limits['speed']:g} % of a drive's velocity limit"),
        ("power", f"{100 * limits['power']:g} % of torque limit times velocity limit"),
        ("policy_far", f"{limits['far']:g} units of the policy's action"),
        ("stall", f"{limits['stall']:g} s at the torque limit without motion"),
        ("temperature", f"{limits['hot']:g} °C; warns at {limits['warm']:g} °C"),
    ]
    return [
        text("The guard damps by itself, on this sheet's limits:"),
        pairs(("rule", "damps at"), rows, "limits of the guard"),
        text(
            "Stop by hand, before that, when the robot leans further than its motion's largest tilt above, when a rule "
            "damps twice for the same reason, when a motor is warm, or when anything sounds new."
        ),
    ]
