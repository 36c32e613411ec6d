"""The command `cohaptic stability`, which judges given gains and names safe gains."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cohaptic.cli.output import Overwrite, new_output
from cohaptic.control.law import DEFAULT_LAW, Law
from cohaptic.errors import SettingError, one_line

if TYPE_CHECKING:
    from cohaptic.control.stability.single_contact import Floats


# Above 60 lines because typer takes each option with its help from the signature.
def stability(
    law: Annotated[Law, typer.Option(help="Control law.")] = DEFAULT_LAW,
    k_o: Annotated[float, typer.Option(help="Stiffness of the object at the contact [N/m].")] = 200,
    k_h: Annotated[
        str | None,
        typer.Option(
            help="Gain [N/m]; with --compliance one for each contact, as JSON.",
            show_default="100, and with --delays 1 / C_ii",
        ),
    ] = None,
    integral_gain: Annotated[
        float, typer.Option(help="Integral gain I of the law [N/(m s)].")
    ] = 0.0,
    b_o: Annotated[
        float,
        typer.Option(
            help="Damping of the object over the simulation period, the paper's eq. (9) [N/m]."
        ),
    ] = 0.0,
    sim_period: Annotated[
        float, typer.Option(help="Simulation period N T [s].", show_default="1/60")
    ] = 1.0 / 60.0,
    haptic_period: Annotated[float, typer.Option(help="Haptic period T [s].")] = 0.001,
    delay: Annotated[
        float, typer.Option(help="Network round trip, on top of one simulation period [s].")
    ] = 0.0,
    compliance: Annotated[
        str | None,
        typer.Option(help="Compliance matrix C of several contacts [m/N], as JSON rows."),
    ] = None,
    delays: Annotated[
        str | None,
        typer.Option(
            help="With --compliance: loop delay of each user [s], as JSON: from a force to the "
            "surface that answers it, ramp included."
        ),
    ] = None,
    lag: Annotated[
        float | None,
        typer.Option(
            help="With --delays: lag of the room to judge [s], where no forces are anticipated "
            "(science 3.8).",
            show_default="as the server: 0 where the coupling is below 1, else lag_needed / 0.7",
        ),
    ] = None,
    area: Annotated[
        bool, typer.Option("--area", help="Also give the stable set of K_h and I as a polygon.")
    ] = False,
    json_to: Annotated[
        str | None, typer.Option("--json", help="Write JSON to this file; - prints it.")
    ] = None,
    overwrite: Overwrite = False,
) -> None:
    """Say whether a local model is stable, and for which gains.

    One hand alone is always stable with the predictive law: its own force never comes back to it.
    For other laws the whole loop is judged, beside the paper's conditions (docs/science.md). With
    --compliance: several contacts, at any delay, and safe gains. With --delays too: the whole room.
    """
    path = None if json_to is None or json_to == "-" else Path(json_to)
    output = new_output("--json", path, overwrite=overwrite)
    import numpy as np

    from cohaptic.cli.stability_answers import alone, area_corners, room, several

    gain = None if k_h is None else _numbers("k_h", k_h)
    hundred = np.array(100.0) if gain is None else gain
    if compliance is None:
        for name, value in (("delays", delays), ("lag", lag)):
            if value is not None:
                raise SettingError(name, value, "left out without --compliance")
        if hundred.size != 1:
            raise SettingError("k_h", k_h, "one number, or --compliance with as many contacts")
        one = float(hundred.reshape(-1)[0])
        answer = alone(law, k_o, one, integral_gain, b_o, sim_period, haptic_period, delay)
        if area:
            corners = area_corners(k_o, b_o, sim_period, int(answer["rate_ratio"]), delay)
            answer["area"] = corners
    elif delays is None:
        if lag is not None:
            raise SettingError("lag", lag, "left out without --delays")
        C = _numbers("compliance", compliance)
        answer = several(law, C, hundred, integral_gain, sim_period, delay)
    else:
        for name, value in (("delay", delay), ("integral_gain", integral_gain), ("b_o", b_o)):
            if value != 0.0:
                raise SettingError(name, value, "left out with --delays")
        if area:
            raise SettingError("area", "on", "left out with --delays")
        C, T = _numbers("compliance", compliance), _numbers("delays", delays)
        answer = room(law, C, T, gain, lag, sim_period)
    text = json.dumps(answer, indent=2)
    if json_to == "-":
        typer.echo(text)
    elif output is not None:
        output.write(text + "\n")
    else:
        _show(answer)


def _numbers(name: str, text: str) -> Floats:
    """Read an array from JSON text.

    Raises:
        SettingError: The text, which the error quotes under `name`, is not valid.
    """
    import numpy as np

    try:
        value = json.loads(text)
        if "true" in text or "false" in text:
            raise ValueError(text)
        return np.array(value, dtype=np.float64)
    except (ValueError, TypeError, OverflowError, RecursionError) as error:
        limit = "numbers as JSON, such as 150 or [150, 120]"
        raise SettingError(name, repr(one_line(text)), limit) from error


def _show(answer: dict[str, Any]) -> None:
    from rich.console import Console
    from rich.table import Table

    from cohaptic.cli.stability_words import in_words

    table = Table(show_header=False, box=None)
    for words, value in in_words(answer):
        table.add_row(words, value)
    Console().print(table)
