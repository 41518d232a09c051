"""What only rollouts show that were not fitted: it can be neither named nor ruled out, and a note says so.

A target that is limited in rate, a hit, a slip may happen once, in a run that was put aside. Nothing that is fitted
tells of it, and no test of what is left sees it; the error after is then large, and nothing else says why.
"""

from collections.abc import Sequence

from bumblebee.diagnosis.roles import window_errors
from bumblebee.diagnosis.session import Session
from bumblebee.sim.effects import Effect

_FAR = 10.0  # times as far off as the worst fitted window


def unseen_notes(session: Session, effects: Sequence[Effect], horizon: float) -> list[str]:
    """A note for each rollout that was not fitted with windows of `horizon` [s] far further off than any fitted one."""
    errors = window_errors(session, effects, horizon, session.steps[0])
    fitted = [i for i in session.train if i not in session.accept and i in errors]
    if not fitted:
        return []
    bound = _FAR * max(errors[i][0] for i in fitted)
    notes = []
    for i in sorted(set(errors) - set(fitted)):
        far = int((errors[i] > bound).sum())
        if far:
            times = errors[i][0] / bound * _FAR
            notes.append(
                f"{session.ids([i])[0]}: {far} of {len(errors[i])} windows up to {times:.0f} times further off "
                "than any fitted one. Something acts there that no fitted rollout shows: it is neither named nor ruled "
                "out. Record more of such motion."
            )
    return notes
