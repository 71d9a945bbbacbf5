"""What the words of the reports mean, for whoever has never read the documentation: (word, meaning)."""

from __future__ import annotations

TERMS = (
    ("Model", "A simulated robot: its description, and the effects that have been added to it."),
    ("Trial", "One recorded run of the robot: what was commanded, and what its sensors said."),
    ("Channel", "One sensor of the robot, such as the position of one joint."),
    ("Residual", "What was measured less what the model predicts. A perfect model leaves noise and nothing else."),
    (
        "Standard deviations",
        "How errors of channels with different units are made comparable: each residual is divided by the size that noise, "
        "and models as good as this one, would give it. 1 is ordinary, 3 is rare, 10 is wrong.",
    ),
    ("Error", "How large the residual is over all channels and all time, as one number; the foot of this page says how "
        "exactly. Lower is better."),
    ("Softened", "Residuals beyond a few standard deviations count less than in full, so that one spike does not decide."),
    (
        "Noise floor",
        "The error that a perfect model would still have, because sensors are noisy. No model needs to be better; an error at "
        "the floor means that nothing is left to explain.",
    ),
    ("Regime", "What a joint was doing at the time: moving or at rest, up or down, near a limit, under load."),
    ("Window", "A short stretch of one trial, the smallest piece that is held out or that a map shows."),
    (
        "Held out",
        "Judged on data that the fit had not seen: parameters are fitted on some windows or trials, and the error is taken on "
        "the others. What only imitates noise does worse there.",
    ),
    ("Effect", "A piece of physics that a model can lack: friction, play, a weak motor, a sensor with an offset."),
    ("Candidate", "An effect at a place, fitted to the measurements as a possible explanation."),
    ("Gain", "The share of the squared error on held-out data that a candidate takes off. 0 % is useless, and "
        "less than that makes it worse."),
    (
        "Above the noise",
        "The part of the squared error that is not noise. A candidate that takes off 100 % of it leaves noise alone.",
    ),
    (
        "95 % interval",
        "Where the value would lie in 95 of 100 repetitions with other pieces of the same data. Where more than noise is left: "
        "as wide as an effect of the size of the rest, missing in the model, could make it.",
    ),
    (
        "Tie",
        "Two explanations that these measurements cannot tell apart: their errors differ by less than chance. Either may be the "
        "true one; another trial may separate them.",
    ),
    ("Earned, refused", "A candidate earns its place if its gain is more than luck; all others are refused and drawn hatched."),
    ("Ladder", "The models on the way to the improved one, each with one effect more, everything fitted anew at each step."),
    (
        "Ways of comparing",
        "Open loop: the recorded commands drive the model, and every channel is compared. Free run: the model runs the whole "
        "record by itself in the loop of the robot's own controller, and positions are compared. Balance of forces: the "
        "recorded motion is put into the equation of motion, and forces are compared.",
    ),
)  # fmt: skip
