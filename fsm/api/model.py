"""Models that are built in Python: sections of a case, added one by one."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from fsm.api.case import Case, load
from fsm.case.loading.overrides import check_path, place_at
from fsm.case.models.case import root
from fsm.case.schema.model import Model as Section
from fsm.errors import CaseError

if TYPE_CHECKING:
    from fsm.api.case import CaseCheck, Result


class Model:
    """Case under construction. Each method adds a section and returns the model; `solve` runs it.

    Keys and values are those of case files: ``length="480 mm"``, or plain numbers in SI. `add` accepts any section by its
    name in the case file, and any object such as `Body`. The methods below name the usual sections.

    Parameters
    ----------
    title : str
    folder : str or Path
        Folder to which names of data files are relative.
    keys : keys at the top of a case, for example ``gravity=[0, 0, -9.81]``

    Examples
    --------
    >>> import fsm
    >>> model = fsm.Model("pendulum", gravity=[0, 0, -9.81])
    >>> model = model.body("rod", mass="0.2 kg", inertia=[1e-5, 6.7e-4, 6.7e-4], position=["0.1 m", 0, 0])
    >>> model = model.element("pivot", inner="rod", outer="ground", point_inner=["-0.1 m", 0, 0],
    ...                       translation=[1e5, 1e5, 1e5], translation_damping=[10, 10, 10])
    >>> result = model.settings(end_time="0.1 s").solve()
    >>> round(float(result.time[-1]), 3)
    0.1
    """

    def __init__(self, title: str = "", *, folder: str | Path = ".", **keys: Any) -> None:
        self._tables: dict[str, Any] = {**({"title": title} if title else {}), **keys}
        self._folder = Path(folder)

    def add(self, *items: Any, **keys: Any) -> Self:
        """Add objects, or one section by its name with its keys.

        Parameters
        ----------
        items : objects such as `Body` or `Drive`, or the name of a section: ``model.add("scene.bodies", name="rod", ...)``
        keys : keys of the section

        Raises
        ------
        CaseError
            No section has this name, or an object is not part of a case.
        """
        if len(items) == 1 and isinstance(items[0], str):
            self._put(items[0], keys)
            return self
        if keys:
            raise CaseError('give keys with the name of their section: add("scene.bodies", name="rod", ...)', "Model.add")
        for item in items:
            place = _places().get(type(item))
            if place is None:
                text = f"an object of the type {type(item).__name__} is not a section of a case; give a name and keys"
                raise CaseError(text, "Model.add")
            self._put(place, item)
        return self

    def _put(self, path: str, section: Any) -> None:
        """Append to a list of sections, or set a section."""
        problem = check_path(path)
        if problem:
            raise CaseError(f"{path}: {problem}", "Model.add")
        place, here = place_at({}, path), self._tables
        *outer, last = path.split(".")
        for key in outer:
            here = here.setdefault(key, {})
        if place is not None and place.is_list_of_sections():
            here.setdefault(last, []).append(section)
        elif isinstance(section, Mapping) and isinstance(here.get(last), Mapping):
            here[last] = {**here[last], **section}
        else:
            here[last] = section

    def strip(self, **keys: Any) -> Self:
        """Add a folded strip: length, width, thickness (m), panels, fold_angle (rad), ..."""
        return self.add("strip", **keys)

    def lattice(self, **keys: Any) -> Self:
        """Add a lattice of rotating squares: columns, rows, spacing, hinge_length, depth (m), angle (rad), ..."""
        return self.add("lattice", **keys)

    def sheet(self, **keys: Any) -> Self:
        """Add a folded sheet: kind, columns, rows, sides and thickness (m), angles (rad), support, ..."""
        return self.add("sheet", **keys)

    def membrane(self, **keys: Any) -> Self:
        """Add a film that vibrates: length, width, thickness (m), mesh."""
        self._tables.setdefault("analysis", "vibrate")
        return self.add("membrane", **keys)

    def scissor(self, **keys: Any) -> Self:
        """Add an array of scissor units: units, bar_length (m), initial_angle (rad), ..."""
        self._tables.setdefault("analysis", "scissor")
        return self.add("scissor", **keys)

    def material(self, **keys: Any) -> Self:
        """Add the material of a strip, a film or bars: young (Pa), poisson, density (kg/m^3), damping (s)."""
        return self.add("material", **keys)

    def crease(self, **keys: Any) -> Self:
        """Add the law of the creases of a strip: law, stiffness (N m/rad), ..."""
        return self.add("crease", **keys)

    def contact(self, **keys: Any) -> Self:
        """Add contact: law, stiffness (N/m^1.5), damping (N s/m), ..."""
        return self.add("contact", **keys)

    def friction(self, **keys: Any) -> Self:
        """Add friction: law, mu_static, mu_dynamic, v_static (m/s), ..."""
        return self.add("friction", **keys)

    def body(self, name: str, **keys: Any) -> Self:
        """Add a rigid body: mass (kg), inertia (kg m^2), position (m), plate, ..."""
        return self.add("scene.bodies", name=name, **keys)

    def element(self, name: str, **keys: Any) -> Self:
        """Add a force element between two bodies: inner, outer, point_inner (m), translation (N/m), rotation (N m/rad)."""
        return self.add("scene.elements", name=name, **keys)

    def joint(self, name: str, **keys: Any) -> Self:
        """Add an ideal joint between two bodies: kind, first, second, at (m), axis, spring, damper, stop, latch, motor."""
        return self.add("scene.joints", name=name, **keys)

    def wing(self, **keys: Any) -> Self:
        """Add a wing of hinged panels: panels, length, width, thickness (m), mass (kg), yoke, hinge, ..."""
        return self.add("wing", **keys)

    def film(self, name: str, **keys: Any) -> Self:
        """Add a film to the scene: length, width, thickness (m), young (Pa), density (kg/m^3), mesh, ..."""
        return self.add("scene.films", name=name, **keys)

    def cable(self, name: str, **keys: Any) -> Self:
        """Add a cable to the scene: start, end, diameter (m), young (Pa), density (kg/m^3), ..."""
        return self.add("scene.cables", name=name, **keys)

    def beam(self, name: str, **keys: Any) -> Self:
        """Add a beam to the scene: start, end, width, thickness (m), young (Pa), density (kg/m^3), ..."""
        return self.add("scene.beams", name=name, **keys)

    def frame(self, name: str, **keys: Any) -> Self:
        """Add a frame on a film, a cable or a beam, for force elements and loads: on, at (m)."""
        return self.add("scene.frames", name=name, **keys)

    def seam(self, name: str, **keys: Any) -> Self:
        """Add a seam between an edge of a film and bodies: film, edge, bodies; stiffness (Pa), or clamped."""
        return self.add("scene.seams", name=name, **keys)

    def pair(self, first: str, second: str, **keys: Any) -> Self:
        """Add a contact pair of the scene."""
        return self.add("scene.pairs", first=first, second=second, **keys)

    def obstacle(self, name: str, **keys: Any) -> Self:
        """Add a rigid obstacle: shape, position (m), ..."""
        return self.add("obstacle", name=name, **keys)

    def drive(self, **keys: Any) -> Self:
        """Add a prescribed motion of a crease, body or edge: travel (m) and speed (m/s), or turn (rad) and rate (rad/s)."""
        return self.add("drive", **keys)

    def load(self, **keys: Any) -> Self:
        """Add a force (N) or a couple (N m) on a body."""
        return self.add("load", **keys)

    def step(self, name: str, kind: str, **keys: Any) -> Self:
        """Add a step: "static", "dynamic", "relax" or "modes", with its drives and loads."""
        return self.add("step", name=name, kind=kind, **keys)

    def settings(self, **keys: Any) -> Self:
        """Set keys of the solver, the section `[solve]`: end_time (s), rtol, method, ..."""
        return self.add("solve", **keys)

    def record(self, *channels: str, **keys: Any) -> Self:
        """Record channels that match patterns, and set keys of `[save]`: every (m), interval (s), ..."""
        known = self._tables.get("save", {}).get("channels", [])
        return self.add("save", **({"channels": [*known, *channels]} if channels else {}), **keys)

    @property
    def case(self) -> Case:
        """Checked case of the model.

        Raises
        ------
        CaseError
            All faults of the model.
        """
        return load(self._tables, folder=self._folder)

    def check(self) -> CaseCheck:
        """Describe the model without solving it; see `Case.check`."""
        return self.case.check()

    def solve(
        self,
        steps: Iterable[Any] | None = None,
        out: str | Path | None = None,
        *,
        channels: str | Iterable[str] | None = None,
    ) -> Result:
        """Solve the model.

        Parameters
        ----------
        steps : iterable of Step or dict, optional
            Steps of the run, each of which begins where the last one ended. The given steps replace the steps of the model.
        out, channels : see `Case.run`

        Raises
        ------
        CaseError, NotConverged, EnergyAbort
        """
        if isinstance(steps, str | Path):
            raise CaseError(f'steps is a list of steps, not "{steps}"; give the folder of the files as out=', "Model.solve")
        case = self.case if steps is None else load({**self._tables, "step": list(steps)}, folder=self._folder)
        return case.run(out, channels=channels)

    def __repr__(self) -> str:
        return f"Model({', '.join(self._parts())})"

    def _repr_html_(self) -> str:
        return f"<div>{escape(repr(self))}</div>"

    def _parts(self) -> list[str]:
        parts = [repr(self._tables["title"])] if self._tables.get("title") else []
        scene = self._tables.get("scene", {})
        flat = {key: value for key, value in self._tables.items() if key not in ("title", "scene")}
        for key, value in {**flat, **(scene if isinstance(scene, Mapping) else {})}.items():
            count = isinstance(value, list) and value and isinstance(value[0], Mapping | Section)
            parts.append(f"{key}: {len(value)}" if count else key)
        return parts


@cache
def _places() -> dict[type, str]:
    """Section of each type of object: those at the top of a case, then those of a scene."""
    found: dict[type, str] = {}
    for outer in ("", "scene."):
        place: Any = root({}) if not outer else root({}).step("scene")
        known: list[str] = place.keys()
        for key in known:
            inner = place.step(key)
            for each in (inner, inner.step(0)):
                for model in each.all_models() if each is not None else ():
                    found.setdefault(model, f"{outer}{key}")
    return found
