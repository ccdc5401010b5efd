"""The exercises run from top to bottom: unsolved all checks say not yet, with their solutions right."""

import ast
import json
import runpy

import nbformat
import pytest

from wam_cast.teaching.exercises import EXERCISES, Standing, check

CHECKS = {
    "01_hand_kinematics": ["shipped.is_caught and yours.is_caught", "abs(yours.miss - shipped.miss) < 1e-3"],
    "02_flat_output": [
        "swings['yours'][times > duration].max() < 0.003",
        "swings['as if there were no ball'][times > duration].max() > 0.1",
    ],
    "03_kernel_ridge": [
        "kernel_error < 0.9 * polynomials[:, 2].min()",
        "polynomials[-1, 2] > 2 * polynomials[:, 2].min() > 10 * polynomials[-1, 0]",
        "np.abs(np.log(polynomials[:, 1] / polynomials[:, 2])).max() < 0.5",
    ],
    "04_planning_under_uncertainty": [
        "disc_probability(offsets[likeliest], stds[likeliest], clear) > 0.7",
        "disc_probability(offsets[nearest], stds[nearest], clear) < 0.4",
        "np.mean(np.hypot(*landings['most likely to hit'].T) < clear) > 0.5",
    ],
    "05_contact_and_restitution": [
        "caught[:, 0].all() and caught[0].all() and not caught[-1].all()",
        "list(caught.sum(axis=1)) == sorted(caught.sum(axis=1), reverse=True)",
    ],
    "06_adapting": [
        "np.abs(misses[0]).min() > 20",
        "np.abs(misses[1]).max() < 0.7 * np.abs(misses[0]).min()",
        "np.abs(misses[3]).max() < 10",
    ],
}
"""By exercise, what must be true after its solution ran."""

CHEAPER = {("04_planning_under_uncertainty", "execute"): ("range(12)", "range(6)")}
"""By exercise and cell, what it casts often, to show a share, and what runs instead."""

BOUNCES = "05_contact_and_restitution"


def cells_of(text):
    return [cell for cell in json.loads(text)["cells"] if cell["cell_type"] == "code"]


def functions_of(source):
    """Return by name the functions that source text defines at its top level: node and text."""
    tree = ast.parse(source)
    nodes = [node for node in tree.body if isinstance(node, ast.FunctionDef)]
    return {node.name: (node, ast.get_source_segment(source, node)) for node in nodes}


@pytest.fixture(scope="module")
def solution_of(exercise_paths):
    """Return a function that gives the source of an exercise's solution."""

    def read(name):
        path = exercise_paths[name].parents[1] / "solutions" / f"{name}.py"
        return path, path.read_text(encoding="utf-8")

    return read


def test_every_exercise_has_its_notebook_solution_and_checks(exercise_paths, solution_of):
    assert list(EXERCISES) == list(exercise_paths) == list(CHECKS)
    for name, tasks in EXERCISES.items():
        path, source = solution_of(name)
        assert list(functions_of(source)) == list(tasks)
        assert path.parent.name == "solutions"


@pytest.mark.parametrize("name", EXERCISES)
def test_each_task_is_asked_for_and_checked_in_order_and_is_not_answered(name, exercise_paths, committed, solution_of):
    cells = cells_of(committed(exercise_paths[name]))
    by_id = {cell["id"]: "".join(cell["source"]) for cell in cells}
    tasks = [key for key in by_id if key in EXERCISES[name]]
    assert tasks == list(EXERCISES[name])
    _, source = solution_of(name)
    for task, (answer, _) in functions_of(source).items():
        assert by_id[f"{task}-check"] == f"check({task})"
        ((_, (asked, _)),) = functions_of(by_id[task]).items()
        assert ast.unparse(asked.args) == ast.unparse(answer.args)
        assert ast.unparse(asked.body[1:]) == "return ..." if len(asked.body) > 1 else False
        assert len(ast.get_docstring(asked)) > 40
        namespace = {}
        exec(by_id[task], namespace)
        verdict = check(namespace[task])
        assert (verdict.standing, str(verdict)) == (Standing.NOT_YET, f"{task}: not yet")


@pytest.mark.parametrize("name", EXERCISES)
def test_solutions_are_right_on_other_inputs_too(name, solution_of):
    answers = runpy.run_path(str(solution_of(name)[0]))
    for task in EXERCISES[name]:
        verdict = check(answers[task], seed=1)
        assert str(verdict) == f"{task}: right"


@pytest.mark.slow
def test_unsolved_exercises_run_from_top_to_bottom_and_each_check_says_not_yet(exercise_paths, committed, run_notebook):
    cells = []
    for name, path in exercise_paths.items():
        # Lively cups take as long as all else, and no answers.
        sources = {cell["id"]: "".join(cell["source"]) for cell in cells_of(committed(path))}
        cells += [(name, key, text) for key, text in sources.items() if (name, key) != (BOUNCES, "cups")]
    executed = run_notebook(nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(text) for *_, text in cells]))
    shown = {}
    for (name, key, _), cell in zip(cells, executed.cells[1:], strict=True):
        shown[name, key] = [output.get("text") or output["data"]["text/plain"] for output in cell.outputs]
    for name, tasks in EXERCISES.items():
        assert [shown[name, f"{task}-check"] for task in tasks] == [[f"{task}: not yet"] for task in tasks]
    assert shown[BOUNCES, "rebound-picture"] == ["solve first: rebound_speed\n"]


@pytest.mark.slow
def test_solved_exercises_run_and_their_results_are_right(exercise_paths, committed, solution_of, run_notebook):
    # All in one kernel, which loads Drake once; each begins without the names of the one before it.
    cells = []
    for name, path in exercise_paths.items():
        _, source = solution_of(name)
        imports = [node for node in ast.parse(source).body if isinstance(node, ast.Import | ast.ImportFrom)]
        solved = {task: text for task, (_, text) in functions_of(source).items()}
        verdicts = [f"assert check({task}).is_right, {task!r}" for task in solved]
        sources = {cell["id"]: "".join(cell["source"]) for cell in cells_of(committed(path))}
        for (exercise, key), (words, cheaper) in CHEAPER.items():
            if exercise == name:
                assert words in sources[key]
                sources[key] = sources[key].replace(words, cheaper)
        checked = {f"{task}-check" for task in solved}
        cells += ["%reset -f", "\n".join(map(ast.unparse, imports))]
        cells += [solved.get(key, text) for key, text in sources.items() if key not in checked]
        cells += [*verdicts, *(f"assert {one}" for one in CHECKS[name])]
    executed = run_notebook(nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(text) for text in cells]))
    outputs = [output for cell in executed.cells for output in cell.get("outputs", [])]
    assert [output.text for output in outputs if output.get("name") == "stderr"] == []
