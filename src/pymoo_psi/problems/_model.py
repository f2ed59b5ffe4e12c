"""What a study knows of a problem: the columns of its tests, and what identifies its model."""

from __future__ import annotations

import hashlib
import inspect
import json
import os
from collections.abc import Collection, Mapping
from typing import Any

import msgspec
import numpy as np
from pymoo.core.problem import Problem

from pymoo_psi._kinds import Kind, option_text
from pymoo_psi._validation import Values, invalid, known_names, name_list
from pymoo_psi.parallel import Runner
from pymoo_psi.problems._design_space import DesignSpace, design_space
from pymoo_psi.problems._pymoo import column_titles, problem_name
from pymoo_psi.problems._wrapped import Wrapper, layers, within_same_columns
from pymoo_psi.table import OUTPUT, Column, Schema, unit_texts

_LONGEST = 1000  # characters of a constant of a model that a study shows


def problem_schema(
    problem: Any,
    space: DesignSpace,
    names: Mapping[str, str] | None = None,
    maximize: Collection[str] | None = None,
    units: Mapping[str, str] | None = None,
) -> Schema:
    """Return the columns of a problem's tests, under the user's names.

    Args:
        problem: A pymoo problem, which may have attributes ``names``, ``maximize`` and ``units``.
        space: Its variables.
        names: The user's names of columns by their default names, instead of the attribute.
        maximize: The objectives that ``out["F"]`` has with the opposite sign, by the user's names;
            they include those of the attribute, unless ``names`` are given.
        units: Units by the user's names, instead of the attribute; also for further outputs.

    Raises:
        ArgumentValueError: There is no such column, or two would have the same name.
        ArgumentTypeError: A name or unit is not text, or an argument has the wrong type.
    """
    titles = column_titles(problem)
    new_names = titles if names is None else names
    default = _default_schema(problem, space)
    known_names("names", new_names, default.names)
    schema = default.changed(name=new_names)
    # The attributes of a problem name columns by default or by names of its own.
    renamed = dict(zip(default.names, schema.names, strict=True))
    for name, title in titles.items():
        renamed[title] = new_names.get(name, name)

    stated = name_list("maximize", getattr(problem, "maximize", None) or ())
    own_maximize = [renamed.get(name, name) for name in stated]
    if maximize is None:
        maximize = own_maximize
    elif maximize and names is None and not {*own_maximize} <= {*maximize}:
        raise invalid(
            "maximize",
            f"a list that includes the problem's own, {', '.join(own_maximize)}",
            maximize,
            "or change the problem's attribute",
        )
    if units is None:
        own_units = unit_texts(getattr(problem, "units", None) or {}).items()
        units = {renamed.get(name, name): unit for name, unit in own_units}

    # A further output with a unit is promised by that.
    outputs = [Column(name, OUTPUT) for name in unit_texts(units) if name not in schema.names]
    schema = schema.with_columns(*outputs).with_units(units)
    known_names("maximize", maximize, (*schema.objectives, *schema.outputs))
    return schema.changed(maximize=dict.fromkeys(maximize, True))


def _default_schema(problem: Any, space: DesignSpace) -> Schema:
    """Return the columns of a problem's tests under default names."""
    kinds = [variable.kind for variable in space.variables]
    unbounded = [kind in (Kind.BINARY, Kind.CHOICE) for kind in kinds]
    return Schema.of(
        space.variable_names,
        problem.n_obj,
        problem.n_ieq_constr,
        problem.n_eq_constr,
        lower=np.where(unbounded, np.nan, space.lower),
        upper=np.where(unbounded, np.nan, space.upper),
        kinds=kinds,
    )


# The identity of a model


def problem_identity(problem: Any) -> tuple[Values, list[str]]:
    """Return what identifies the model of a problem for a study, as plain values.

    The names and kinds of the variables belong to it as well; bounds, requirements, names of
    objectives and limits do not, so that all of these may be changed.

    The name is not enough, as a model has constants. So what the problem was made with is included,
    or else what its method ``fingerprint()`` returns, such as the chute's; for a wrapper with such
    a method, that of the wrapped problem, too. Wrappers that have other columns, or other values in
    them, are named by their classes. Two identities are compared by :func:`identity_facts`.

    Args:
        problem: The problem.

    Returns:
        The identity; and the names of arguments that hold objects that cannot be compared.
    """
    parameters, defaults, others = _parameters(problem)
    model = within_same_columns(problem)
    choices = {}
    for variable in design_space(model, log=()).variables:
        if variable.kind is Kind.CHOICE:
            choices[variable.title] = [*map(option_text, variable.options)]
    expressions = getattr(problem, "known_expressions", {}).items()
    identity: Values = {
        "problem": problem_name(problem),
        "choices": choices,
        "parameters": parameters,
        "defaults": defaults,
        "wrappers": [type(p).__name__ for p in layers(problem)[:-1] if not p.same_columns],
        "expressions": {name: known.text for name, known in expressions},
        "logarithms": [*getattr(problem, "logarithms", ())],
    }
    if not getattr(model, "has_named_outputs", False):
        # int, as JSON has no NumPy integers, which OpenMDAO's problems have
        identity["objectives"] = int(model.n_obj)
    return identity, others


def _parameters(problem: Any) -> tuple[Values, Values, list[str]]:
    """Return what a problem's ``fingerprint()`` returns, or the constants that it was made with.

    Returns:
        The parameters; the arguments that have their default values, by their paths among the
        parameters, which do not include them; and the names of arguments that cannot be compared.
    """
    if not isinstance(problem, Wrapper):
        if callable(getattr(problem, "fingerprint", None)):
            return dict(problem.fingerprint()), {}, []
        return _constants(problem)
    parameters, defaults, others = _parameters(problem.wrapped)
    if hasattr(type(problem), "fingerprint"):
        parameters = {**problem.fingerprint(), "wrapped": parameters}
        defaults = {f"wrapped.{name}": value for name, value in defaults.items()}
    return parameters, defaults, others


def _constants(model: Any) -> tuple[Values, Values, list[str]]:
    """Return the constants that a model was made with; see :func:`_parameters`.

    They are the arguments of its classes that it keeps as attributes of the same name, or with an
    underscore before it.
    """
    parameters = {}
    defaults = {}
    others = []
    for name, default in _arguments(type(model)).items():
        kept = _kept(model, name, default)
        if kept is inspect.Parameter.empty:
            continue
        constant, has_objects = _constant(kept)
        if has_objects:
            others.append(name)
        default_constant, _ = _constant(default)
        if kept is default or constant == default_constant:  # NaN is not equal
            defaults[name] = default_constant  # 1 is kept as 1.0 if that is the default
        else:
            parameters[name] = constant
    return parameters, defaults, others


def _arguments(kind: type) -> Values:
    """Return the default values of the arguments of a problem's classes.

    Of pymoo's own arguments there is only the one that changes values.
    """
    defaults = {}
    for base in reversed(kind.__mro__):
        if issubclass(base, Problem):
            for name, argument in inspect.signature(base).parameters.items():
                defaults[name] = argument.default
    for name in {*inspect.signature(Problem).parameters} - {"replace_nan_values_by"}:
        del defaults[name]
    return defaults


def _kept(model: Any, name: str, default: Any) -> Any:
    """Return what a model keeps of an argument, no method of the same name; or its default."""
    for attribute in (name, f"_{name}"):
        value = getattr(model, attribute, model)
        if value is not model and getattr(value, "__self__", None) is not model:
            return value
    return default


def _constant(value: Any) -> tuple[Any, bool]:
    """Return a constant of a model as JSON has it, or the hash of one that is too long to show.

    Numbers, texts, arrays, lists, mappings and data classes count, and functions and classes by
    their names. A path and a runner are None: they say where something is or runs, not what.

    Returns:
        The constant; and whether objects of other kinds are in it, which are None, too.
    """
    objects = []

    def plain(part: Any) -> Any:
        if isinstance(part, (os.PathLike, Runner)):
            return None
        if hasattr(part, "to_numpy"):  # of pandas and polars
            labels = getattr(part, "axes", [getattr(part, "columns", [])])
            return [part.to_numpy(), *[[str(label) for label in axis] for axis in labels]]
        if isinstance(part, (np.ndarray, np.generic, range)):
            return np.asanyarray(part).tolist()  # None where it is masked
        # Functions and classes, without the module, which is another one for a script, a worker
        # process, or who imports it; a method with its object. Of lambdas, functions in functions
        # and those with values of another one, there may be several of a name.
        name = getattr(part, "__qualname__", getattr(part, "__name__", "<object>"))
        if "<" not in name and not getattr(part, "__closure__", None):
            owner = getattr(part, "__self__", None)
            return name if owner is None else [name, owner]
        objects.append(part)
        return None

    try:
        constant = msgspec.to_builtins(value, str_keys=True, order="sorted", enc_hook=plain)
    except (RecursionError, TypeError):  # objects that hold each other, or keys that are pairs
        return None, True
    text = json.dumps(constant)
    if len(text) > _LONGEST:
        return hashlib.sha256(text.encode()).hexdigest()[:16], bool(objects)
    return json.loads(text), bool(objects)  # a tuple is a list
