"""The command line with closed forms in place of physics, and with small experiments: a process to be ended.

    python small_command.py WORDS...

It says "ready" when it begins. What worker processes are given to do is in `closed_forms`, so that they need not import this file.
"""

import sys
from functools import partial

import closed_forms

from wam_cast.cli import commands, main, model_choice
from wam_cast.learning import dataset

dataset.simulate_row = closed_forms.row
commands.require_workable = model_choice.require_workable = lambda *_, **__: None
if sys.argv[1] in ("map", "reproduce"):  # what these import takes the others a second
    from wam_cast.experiments import trials

    trials._execute = closed_forms.execute
if sys.argv[1] == "reproduce":
    from wam_cast.experiments.paper import learning_curves, report_figures, reproduce, settings

    learning_curves._run_job = closed_forms.run_job
    reproduce.draw_figures = partial(closed_forms.draw_figures, list(report_figures.CAPTIONS))
    settings.QUICK = {"n_casts": 85, "n_cups": 2, "n_repeats": 1}
if sys.argv[1] == "learn":
    from wam_cast.adaptation import robot
    from wam_cast.adaptation.adaptive_model import AdaptiveModel
    from wam_cast.adaptation.priors.feature_priors import Affine
    from wam_cast.learning.reference import reference_model

    robot.simulate_cast = closed_forms.simulate_cast
    AdaptiveModel.from_prior = lambda robots, believed=None: AdaptiveModel(reference_model(), Affine(robots.believed))

if __name__ == "__main__":
    print("ready", flush=True)
    main()
